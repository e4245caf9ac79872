#include "trace/trace_context.h"

#include <catch2/catch.hpp>
#include <set>

using namespace shaped;

namespace {

const std::string trace = "4bf92f3577b34da6a3ce929d0e0e4736";
const std::string span = "00f067aa0ba902b7";

}  // namespace

TEST_CASE("a traceparent of version 00 is read, to the letter") {
  const struct {
    const char* name;
    std::string header;
    bool valid;
  } table[] = {
      {"the example of the standard", "00-" + trace + "-" + span + "-01", true},
      {"not sampled", "00-" + trace + "-" + span + "-00", true},
      {"flags without meaning", "00-" + trace + "-" + span + "-fe", true},
      {"empty", "", false},
      {"a later version", "01-" + trace + "-" + span + "-01", false},
      {"the forbidden version", "ff-" + trace + "-" + span + "-01", false},
      {"upper case", "00-4BF92F3577B34DA6A3CE929D0E0E4736-" + span + "-01", false},
      {"no hexadecimal digit", "00-4bf92f3577b34da6a3ce929d0e0e473g-" + span + "-01", false},
      {"a trace of zeros", "00-" + std::string(32, '0') + "-" + span + "-01", false},
      {"a span of zeros", "00-" + trace + "-" + std::string(16, '0') + "-01", false},
      {"flags that are no number", "00-" + trace + "-" + span + "-0x", false},
      {"one digit short", "00-" + trace.substr(1) + "-" + span + "-01", false},
      {"more behind it", "00-" + trace + "-" + span + "-01-more", false},
      {"a line end behind it", "00-" + trace + "-" + span + "-01\n", false},
      {"other separators", "00_" + trace + "_" + span + "_01", false},
      {"shifted separators", "00-" + trace + span.substr(0, 1) + "-" + span.substr(1) + "-01", false},
  };
  for (const auto& row : table) {
    INFO(row.name);
    const auto parsed = parseTraceparent(row.header);
    REQUIRE(parsed.has_value() == row.valid);
    if (!row.valid) continue;
    CHECK(parsed->trace_id == trace);
    CHECK(parsed->span_id == span);
  }
  CHECK(parseTraceparent("00-" + trace + "-" + span + "-01")->sampled);
  CHECK_FALSE(parseTraceparent("00-" + trace + "-" + span + "-fe")->sampled);
}

TEST_CASE("a child keeps the trace and has a span of its own") {
  const TraceContext parent{trace, span, true};
  const auto child = parent.child();
  CHECK(child.trace_id == trace);
  CHECK(child.span_id != span);
  CHECK(child.sampled);
  CHECK(parent.header() == "00-" + trace + "-" + span + "-01");
  CHECK(parseTraceparent(child.header()).has_value());
}

TEST_CASE("new traces are valid and differ") {
  std::set<std::string> traces;
  for (int i = 0; i < 1000; ++i) {
    const auto made = newTrace();
    REQUIRE(parseTraceparent(made.header()).has_value());
    REQUIRE_FALSE(made.sampled);
    traces.insert(made.trace_id);
  }
  CHECK(traces.size() == 1000);
}
