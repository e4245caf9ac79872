#include "server/scheduling/request_queue.h"

#include <catch2/catch.hpp>

using namespace shaped::server;
using namespace std::chrono_literals;

namespace {

const Caller ann{"ann", Priority::kNormal}, bob{"bob", Priority::kNormal};

/// A queue whose work writes down its id, and a clock that is set by hand.
struct Room {
  explicit Room(AdmissionLimits limits = {}) : queue(1, limits) {}

  Decision call(std::uint64_t id, const Caller& caller, std::size_t bytes = 0) {
    auto decision = queue.enter(id, caller, Entry::kCall, bytes);
    if (decision.admitted)
      queue.push(
          id, bytes, [this, id] { ran.push_back(id); }, now);
    return decision;
  }
  /// Runs the next piece of work for so many seconds; calls leave at its end.
  std::uint64_t run(double seconds = 1) {
    const auto begun = queue.pop(now);
    begun.work();
    now += std::chrono::duration_cast<RequestQueue::Time::duration>(std::chrono::duration<double>(seconds));
    queue.leave(ran.back());
    queue.ended(begun.client, begun.kind, seconds);
    return ran.back();
  }
  std::vector<std::uint64_t> runAll() {
    std::vector<std::uint64_t> order;
    while (!queue.empty()) order.push_back(run());
    return order;
  }

  RequestQueue queue;
  RequestQueue::Time now{};
  std::vector<std::uint64_t> ran;
};

}  // namespace

TEST_CASE("one client's requests run as they came") {
  Room room;
  for (std::uint64_t id = 1; id <= 4; ++id) room.call(id, ann);
  CHECK(room.runAll() == std::vector<std::uint64_t>{1, 2, 3, 4});
}

TEST_CASE("the urgent overtake") {
  Room room;
  room.call(1, {"ann", Priority::kBatch});
  room.call(2, {"ann", Priority::kNormal});
  room.call(3, {"ann", Priority::kInteractive});
  CHECK(room.runAll() == std::vector<std::uint64_t>{3, 2, 1});
}

TEST_CASE("clients take turns however many requests one has") {
  Room room;
  for (std::uint64_t id = 1; id <= 4; ++id) room.call(id, ann);
  for (std::uint64_t id = 11; id <= 12; ++id) room.call(id, bob);
  CHECK(room.runAll() == std::vector<std::uint64_t>{1, 11, 2, 12, 3, 4});
}

TEST_CASE("turns are by time, not by number") {
  Room room;
  for (std::uint64_t id = 1; id <= 2; ++id) room.call(id, ann);
  for (std::uint64_t id = 11; id <= 14; ++id) room.call(id, bob);
  CHECK(room.run(3) == 1);
  for (const std::uint64_t id : {11, 12, 13}) CHECK(room.run(1) == id);
  CHECK(room.run(1) == 2);  // both had 3 s; hers has waited as long, and she comes first
}

TEST_CASE("who comes anew has neither credit nor debt") {
  Room room;
  for (std::uint64_t id = 1; id <= 6; ++id) room.call(id, ann);
  for (int i = 0; i < 3; ++i) room.run(5);  // the others have waited for longer than ageing takes, but their line moves
  for (std::uint64_t id = 11; id <= 18; ++id) room.call(id, bob);
  // Of her 15 s he may make up the 5 s of the request that began last; then they take turns.
  CHECK(room.runAll() == std::vector<std::uint64_t>{11, 12, 13, 14, 15, 4, 16, 5, 17, 6, 18});
}

TEST_CASE("places, bytes and streams are counted from entering to leaving") {
  Room room({.queue_length = 2,
             .bytes_in_flight = 100,
             .open_streams = 2,
             .client_requests = 2,
             .client_bytes = 80,
             .client_streams = 1});
  CHECK(room.call(1, ann, 60).admitted);
  CHECK(room.call(2, ann, 30).cause == RefusalCause::kClientBytes);
  CHECK(room.call(3, bob, 50).cause == RefusalCause::kBytesInFlight);
  const auto begun = room.queue.pop(room.now);
  CHECK(room.queue.load().queue_length == 0);
  CHECK(room.queue.load().busy == 1);
  CHECK(room.queue.load().bytes_in_flight == 60);  // runs
  CHECK(room.call(3, bob, 50).cause == RefusalCause::kBytesInFlight);
  room.queue.leave(1);
  room.queue.ended(begun.client, begun.kind, 1);
  CHECK(room.queue.load().bytes_in_flight == 0);
  CHECK(room.call(3, bob, 50).admitted);
  CHECK(room.call(4, bob, 20).admitted);
  CHECK(room.call(5, bob, 1).cause == RefusalCause::kClientRequests);
  CHECK(room.call(5, ann, 1).cause == RefusalCause::kQueueLength);
  CHECK(room.queue.withdraw(3).has_value());
  CHECK_FALSE(room.queue.withdraw(3).has_value());
  room.queue.leave(3);
  room.queue.leave(3);
  CHECK(room.queue.load().queue_length == 1);
  CHECK(room.queue.load().bytes_in_flight == 20);

  CHECK(room.queue.enter(7, ann, Entry::kStream, 0).admitted);
  CHECK(room.queue.enter(8, ann, Entry::kStream, 0).cause == RefusalCause::kClientStreams);
  CHECK(room.queue.enter(8, bob, Entry::kStream, 0).admitted);
  CHECK(room.queue.enter(9, {"eve"}, Entry::kStream, 0).cause == RefusalCause::kOpenStreams);
  // A stream's message enters whatever the load, and is there until the next comes or the stream goes.
  room.queue.push(
      7, 500, [] {}, room.now);
  CHECK(room.queue.load().bytes_in_flight == 520);
  CHECK(room.queue.withdraw(7).has_value());
  room.queue.push(
      7, 5, [] {}, room.now);
  CHECK(room.queue.load().bytes_in_flight == 25);
  CHECK(room.queue.withdraw(7).has_value());
  room.queue.leave(7);
  CHECK(room.queue.load().open_streams == 1);
  CHECK(room.queue.load().bytes_in_flight == 20);
}

TEST_CASE("a call that waits for something keeps its place") {
  Room room({.queue_length = 1, .client_requests = 1});
  CHECK(room.call(1, ann).admitted);
  const auto begun = room.queue.pop(room.now);
  room.queue.ended(begun.client, begun.kind, 0.1);  // parked
  CHECK(room.call(2, ann).cause == RefusalCause::kClientRequests);
  room.queue.push(
      1, 0, [] {}, room.now);
  CHECK(room.queue.load().queue_length == 1);
}

TEST_CASE("a call that would wait beyond its deadline is refused, by what its kind and those before it took lately") {
  Room room;
  const auto in = [](double seconds, const char* client = "ann", Priority priority = Priority::kNormal) {
    return Caller{client, priority, "edit", seconds};
  };
  CHECK(room.call(1, in(1)).admitted);  // nothing is known yet
  CHECK(room.run(4) == 1);
  CHECK(room.call(2, in(1)).admitted);  // nobody is before it: whether it can be done is for it to find out
  room.queue.pop(room.now);
  // 4 s until the worker is free, 4 s of its own, and half as much again.
  CHECK_FALSE(room.call(3, in(11.9)).admitted);
  CHECK(room.call(3, in(12.1)).admitted);
  CHECK(room.call(4, in(18.1)).admitted);
  const auto refused = room.call(5, in(23.9));
  CHECK(refused.cause == RefusalCause::kDeadline);
  CHECK_THAT(refused.reason, Catch::Contains("deadline comes in 23900 ms") && Catch::Contains("some 12000 ms"));
  // Who is new waits for one of each other client, not for the whole line; who is more urgent for nobody but who runs.
  CHECK_FALSE(room.call(5, in(17.9, "bob")).admitted);
  CHECK(room.call(5, in(18.1, "bob")).admitted);
  CHECK_FALSE(room.call(6, in(11.9, "bob", Priority::kInteractive)).admitted);
  CHECK(room.call(6, in(12.1, "bob", Priority::kInteractive)).admitted);
}

TEST_CASE("what is withdrawn is no longer waited for") {
  Room room;
  const Caller patient{"ann", Priority::kNormal, "edit", 1000}, hurried{"ann", Priority::kNormal, "edit", 13};
  room.call(1, patient);
  room.run(4);
  room.call(2, patient);
  room.queue.pop(room.now);
  room.call(3, patient);
  CHECK_FALSE(room.call(4, hurried).admitted);
  CHECK(room.queue.withdraw(3).has_value());
  room.queue.leave(3);
  CHECK(room.call(4, hurried).admitted);
  CHECK(room.queue.withdraw(4).has_value());
}
