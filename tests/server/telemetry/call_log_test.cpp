#include "server/telemetry/call_log.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "core/numerics/error.h"
#include "server/telemetry/stderr_sink.h"

using namespace shaped;
using namespace shaped::server;
using namespace std::chrono_literals;
using Catch::Contains;

namespace {

CallRecord record() {
  return {.request_id = 7,
          .method = "Shapes.Project",
          .client = {},
          .model = "bodies@3",
          .outcome = "OK",
          .message = "",
          .seconds = 0.25,
          .queue_seconds = 0.05,
          .compute_seconds = 0.125,
          .peer = "ipv4:127.0.0.1:53012",
          .trace = {"4bf92f3577b34da6a3ce929d0e0e4736", "00f067aa0ba902b7", true},
          .parent_id = "b7ad6b7169203331"};
}

constexpr char kHostile[] = "x\"\nrequest=1 outcome=OK\r\x1b[2J\xc2\x9b\x85\xe2\x80\xa8\x7f";

/// Stderr is a pipe while this lives; lines stay in it.
class CapturedStderr {
 public:
  CapturedStderr() : saved_(dup(2)) {
    REQUIRE(pipe(ends_) == 0);
    dup2(ends_[1], 2);
  }
  ~CapturedStderr() {
    restore();
    close(ends_[0]);
  }
  void restore() {
    if (saved_ < 0) return;
    dup2(saved_, 2);
    close(saved_);
    close(ends_[1]);
    saved_ = -1;
  }
  /// Everything written; restores first.
  std::string text() {
    restore();
    std::string all;
    char piece[4096];
    for (ssize_t count; (count = read(ends_[0], piece, sizeof piece)) > 0;)
      all.append(piece, static_cast<std::size_t>(count));
    return all;
  }

 private:
  int saved_;
  int ends_[2];
};

}  // namespace

TEST_CASE("a call's text line carries its fields") {
  CHECK(textLine(record()) ==
        "request=7 method=Shapes.Project client=- model=bodies@3 outcome=OK seconds=0.250000 queue_seconds=0.050000 "
        "compute_seconds=0.125000 peer=ipv4:127.0.0.1:53012 trace=4bf92f3577b34da6a3ce929d0e0e4736");
  auto refused = record();
  refused.model = "";
  refused.message = "no \"x\"";
  CHECK_THAT(textLine(refused), Contains(" model=- ") && Catch::EndsWith(" message=\"no \\\"x\\\"\""));
}

TEST_CASE("a call's JSON line carries its fields") {
  const auto time = std::chrono::system_clock::time_point(1'700'000'000'042ms);
  const auto line = jsonLine(record(), Severity::kInfo, time);
  CHECK(nlohmann::json::parse(line) == nlohmann::json{{"time", "2023-11-14T22:13:20.042Z"},
                                                      {"level", "info"},
                                                      {"request", 7},
                                                      {"method", "Shapes.Project"},
                                                      {"client", ""},
                                                      {"model", "bodies@3"},
                                                      {"outcome", "OK"},
                                                      {"seconds", 0.25},
                                                      {"queue_seconds", 0.05},
                                                      {"compute_seconds", 0.125},
                                                      {"peer", "ipv4:127.0.0.1:53012"},
                                                      {"trace_id", "4bf92f3577b34da6a3ce929d0e0e4736"},
                                                      {"span_id", "00f067aa0ba902b7"},
                                                      {"parent_id", "b7ad6b7169203331"},
                                                      {"message", ""}});
}

TEST_CASE("clients cannot forge lines or fields, nor send a terminal commands") {
  auto hostile = record();
  hostile.model = hostile.message = kHostile;
  const auto json = jsonLine(hostile, Severity::kWarning, {});
  for (const auto& line : {textLine(hostile), json, jsonLine(std::string(kHostile), Severity::kError, {})})
    for (const unsigned char c : line) REQUIRE((c >= 0x20 && c < 0x7f));
  const auto parsed = nlohmann::json::parse(json);
  CHECK(parsed["request"] == 7);
  CHECK(parsed["outcome"] == "OK");
  CHECK_THAT(parsed["message"].get<std::string>(), Catch::StartsWith("x\"\nrequest=1 outcome=OK\r\x1b[2J\xc2\x9b"));
}

TEST_CASE("the log writes lines of its level and format") {
  CapturedStderr captured;
  startLog("warn", "json");
  logInfo("not this");
  logError("this\nin one line");
  logCall(record(), false);
  auto refused = record();
  refused.outcome = "NOT_FOUND";
  refused.message = "no such model";
  logCall(refused, false);
  stopLog();
  const auto text = captured.text();
  startLog("error");
  REQUIRE(std::count(text.begin(), text.end(), '\n') == 2);
  const auto first = nlohmann::json::parse(text.substr(0, text.find('\n')));
  const auto second = nlohmann::json::parse(text.substr(text.find('\n')));
  CHECK(first["level"] == "error");
  CHECK(first["message"] == "this\nin one line");
  CHECK(second["level"] == "warning");
  CHECK(second["outcome"] == "NOT_FOUND");
}

TEST_CASE("levels and formats that do not exist are refused by name") {
  CHECK_THROWS_WITH(startLog("loud"), Contains("--log: \"loud\""));
  CHECK_THROWS_WITH(startLog("info", "xml"), Contains("--log-format: \"xml\""));
  startLog("error");
}

TEST_CASE("the log gives up a reader that is stuck, whatever it is") {
  int ends[2];
  const auto fill = [&] {
    StderrSink sink(ends[1]);
    for (int i = 0; i < 20000; ++i) sink.log({"shaped", spdlog::level::info, std::string(200, 'x')});
    sink.close();  // waits a second in all
    CHECK(sink.lost() > 0);
    CHECK(sink.lost() < 20000);
  };
  const auto begin = std::chrono::steady_clock::now();
  SECTION("a pipe") {
    REQUIRE(pipe(ends) == 0);
    fill();
  }
  SECTION("the smallest pipe") {
    REQUIRE(pipe(ends) == 0);
    REQUIRE(fcntl(ends[1], F_SETPIPE_SZ, 1) > 0);
    fill();
  }
  SECTION("a socket, as systemd gives its services") {
    REQUIRE(socketpair(AF_UNIX, SOCK_STREAM, 0, ends) == 0);
    fill();
  }
  CHECK(std::chrono::steady_clock::now() - begin < 20s);
  CHECK((fcntl(ends[1], F_GETFL) & O_NONBLOCK) == 0);  // others write there too
  for (const int end : ends) close(end);
}

TEST_CASE("a reader of stderr that is stuck holds up neither callers nor the end, and loses the oldest lines") {
  CapturedStderr captured;
  const auto lost_before = lostLogLines();
  startLog("info");
  constexpr int lines = 20000;  // 4 MB: pipe and queue together hold less
  for (int i = 0; i < lines; ++i) {
    auto call = record();
    call.request_id = static_cast<std::uint64_t>(i);
    logCall(call, false);
  }
  const auto logged = std::chrono::steady_clock::now();  // which a caller that is held up would never reach
  stopLog();
  const auto stopped = std::chrono::steady_clock::now();
  const auto text = captured.text();
  startLog("error");
  CHECK(stopped - logged < 20s);
  const auto written = std::count(text.begin(), text.end(), '\n');
  CHECK(written > 100);  // what the pipe held
  CHECK(lostLogLines() - lost_before + static_cast<std::uint64_t>(written) == lines);
}
