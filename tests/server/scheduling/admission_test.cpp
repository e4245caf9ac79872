#include "server/scheduling/admission.h"

#include <catch2/catch.hpp>

using namespace shaped::server;
using namespace std::chrono_literals;

namespace {

struct Row {
  const char* name;
  Load load;
  Entry entry;
  std::size_t bytes;
  bool admitted;
};

const AdmissionLimits limits{.queue_length = 3, .queue_bytes = 1000, .open_streams = 2};

Load waiting(std::size_t length, std::size_t bytes, std::size_t streams = 0) {
  return {.workers = 2, .busy = 2, .queue_length = length, .queue_bytes = bytes, .open_streams = streams};
}

}  // namespace

TEST_CASE("admission follows the queue's length and bytes") {
  const std::vector<Row> table{
      {"an empty queue takes a call", waiting(0, 0), Entry::kCall, 10, true},
      {"an empty queue takes a call larger than the byte limit", waiting(0, 0), Entry::kCall, 5000, true},
      {"the last place by length", waiting(2, 20), Entry::kCall, 10, true},
      {"full by length", waiting(3, 30), Entry::kCall, 10, false},
      {"exactly full by bytes", waiting(1, 900), Entry::kCall, 100, true},
      {"over the byte limit", waiting(1, 900), Entry::kCall, 101, false},
      {"a stream enters while there is a place", waiting(0, 0, 1), Entry::kStream, 0, true},
      {"no place for another stream", waiting(0, 0, 2), Entry::kStream, 0, false},
      {"a new stream does not enter a full queue", waiting(3, 30, 0), Entry::kStream, 0, false},
      {"an admitted stream goes on whatever the load", waiting(3, 5000, 2), Entry::kContinuation, 5000, true},
  };
  for (const auto& row : table) {
    INFO(row.name);
    const auto decision = admit(row.load, limits, row.entry, row.bytes);
    CHECK(decision.admitted == row.admitted);
    CHECK(decision.reason.empty() == row.admitted);
  }
}

TEST_CASE("a refusal says for want of what") {
  CHECK(admit(waiting(0, 0, 2), limits, Entry::kStream, 0).cause == RefusalCause::kOpenStreams);
  CHECK(admit(waiting(3, 30), limits, Entry::kCall, 10).cause == RefusalCause::kQueueLength);
  CHECK(admit(waiting(1, 900), limits, Entry::kCall, 101).cause == RefusalCause::kQueueBytes);
}

TEST_CASE("a refusal says when the queue will have drained") {
  Load load = waiting(3, 30);
  load.mean_seconds = 2;
  CHECK(admit(load, limits, Entry::kCall, 1).retry_after == 5000ms);  // (3 waiting + 2 running) * 2 s / 2 workers
  load.mean_seconds = 1e-6;
  CHECK(admit(load, limits, Entry::kCall, 1).retry_after == 100ms);
  load.mean_seconds = 1e6;
  CHECK(admit(load, limits, Entry::kCall, 1).retry_after == 60000ms);
}
