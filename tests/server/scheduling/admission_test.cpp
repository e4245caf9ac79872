#include "server/scheduling/admission.h"

#include <catch2/catch.hpp>
#include <optional>

using namespace shaped::server;
using namespace std::chrono_literals;

namespace {

using Cause = RefusalCause;

const AdmissionLimits limits{.queue_length = 8,
                             .bytes_in_flight = 1000,
                             .open_streams = 4,
                             .client_requests = 3,
                             .client_bytes = 400,
                             .client_streams = 2};

struct Row {
  const char* name;
  Load load;
  ClientLoad client;
  Arrival arrival;
  std::optional<Cause> refused;
};

Load load(std::size_t length, std::size_t bytes = 0, std::size_t streams = 0) {
  return {.workers = 2, .busy = 2, .queue_length = length, .bytes_in_flight = bytes, .open_streams = streams};
}

Arrival call(std::size_t bytes = 10, Priority priority = Priority::kNormal) {
  return {.entry = Entry::kCall, .priority = priority, .bytes = bytes};
}
Arrival stream(Priority priority = Priority::kNormal) { return {.entry = Entry::kStream, .priority = priority}; }

const std::vector<Row> table{
    {"nothing there", load(0), {}, call(), {}},
    {"nothing there, and a call larger than both byte limits", load(0), {}, call(5000), {}},
    {"exactly full by bytes", load(1, 900), {}, call(100), {}},
    {"over the bytes in flight", load(1, 900), {}, call(101), Cause::kBytesInFlight},
    {"over the bytes in flight although nothing waits", load(0, 900), {}, call(101), Cause::kBytesInFlight},
    {"bytes refuse whatever the priority", load(1, 900), {}, call(101, Priority::kInteractive), Cause::kBytesInFlight},

    {"interactive takes the last place", load(7), {}, call(1, Priority::kInteractive), {}},
    {"full", load(8), {}, call(1, Priority::kInteractive), Cause::kQueueLength},
    {"normal takes the last place but an eighth", load(6), {}, call(), {}},
    {"normal leaves an eighth", load(7), {}, call(), Cause::kQueueLength},
    {"batch takes the last place of its half", load(3), {}, call(1, Priority::kBatch), {}},
    {"batch leaves a half", load(4), {}, call(1, Priority::kBatch), Cause::kQueueLength},

    {"a deadline that can be met", load(2), {}, {Entry::kCall, Priority::kNormal, 1, 3.1, 1, 1}, {}},
    {"one that likely cannot", load(2), {}, {Entry::kCall, Priority::kNormal, 1, 2.9, 1, 1}, Cause::kDeadline},
    {"one that cannot, but nobody waits", load(0), {}, {Entry::kCall, Priority::kNormal, 1, 0.1, 0, 1}, {}},
    {"a stream has none", load(2), {}, {Entry::kStream, Priority::kNormal, 0, 0.1, 1, 1}, {}},

    {"a stream enters while there is a place", load(0, 0, 3), {}, stream(), {}},
    {"no place for another stream", load(0, 0, 4), {}, stream(), Cause::kOpenStreams},
    {"a new stream does not enter a full queue", load(8), {}, stream(), Cause::kQueueLength},
    {"a stream is not asked about bytes", load(1, 5000), {0, 5000, 1}, stream(), {}},

    {"a client's last request", load(2), {2, 20, 0}, call(), {}},
    {"a client with all its requests", load(2), {3, 30, 0}, call(), Cause::kClientRequests},
    {"whatever its priority", load(2), {3, 30, 0}, call(1, Priority::kInteractive), Cause::kClientRequests},
    {"a client's bytes, exactly", load(2, 300), {1, 300, 0}, call(100), {}},
    {"a client over its bytes", load(2, 300), {1, 300, 0}, call(101), Cause::kClientBytes},
    {"a client's first message may be larger", load(2, 300), {0, 0, 0}, call(401), {}},
    {"a client's last stream", load(0, 0, 1), {0, 0, 1}, stream(), {}},
    {"a client with all its streams", load(0, 0, 2), {0, 0, 2}, stream(), Cause::kClientStreams},
    {"streams do not count as requests", load(0, 0, 2), {2, 20, 2}, call(), {}},
    {"requests do not count as streams", load(3), {3, 30, 0}, stream(), {}},
    {"the client's own limit is told first", load(8, 1000, 4), {3, 400, 2}, call(), Cause::kClientRequests},
};

}  // namespace

TEST_CASE("admission follows queue, bytes, streams, client and priority") {
  for (const auto& row : table) {
    INFO(row.name);
    const auto decision = admit(row.load, row.client, limits, row.arrival);
    CHECK(decision.admitted == !row.refused);
    CHECK(decision.reason.empty() == decision.admitted);
    if (row.refused) CHECK(name(decision.cause) == name(*row.refused));
    if (row.refused) CHECK(decision.retry_after >= 100ms);
  }
}

TEST_CASE("a queue of one has room for every priority") {
  const AdmissionLimits one{.queue_length = 1};
  for (const auto priority : kPriorities) CHECK(queueLengthFor(priority, one) == 1);
}

TEST_CASE("by default one client takes half of what there is") {
  const AdmissionLimits defaults;
  CHECK(2 * defaults.client_requests == defaults.queue_length);
  CHECK(2 * defaults.client_bytes == defaults.bytes_in_flight);
  CHECK(2 * defaults.client_streams == defaults.open_streams);
}

TEST_CASE("a refusal says when what is in the way will have drained") {
  auto full = load(8, 80);
  const auto delay = [&](const ClientLoad& client) { return admit(full, client, limits, call()).retry_after; };
  full.mean_seconds = 2;
  CHECK(delay({}) == 10000ms);        // (8 waiting + 2 running) * 2 s / 2 workers
  CHECK(delay({3, 3, 0}) == 3000ms);  // of these, the client's own 3
  full.mean_seconds = 1e-6;
  CHECK(delay({}) == 100ms);
  full.mean_seconds = 1e6;
  CHECK(delay({}) == 60000ms);
}
