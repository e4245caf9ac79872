#include "server/scheduling/worker_pool.h"

#include <atomic>
#include <catch2/catch.hpp>
#include <future>
#include <memory>

using namespace shaped::server;

namespace {

/// Occupies a worker until released.
struct Blocker {
  std::promise<void> entered, release;
  std::function<void()> work() {
    return [this] {
      entered.set_value();
      release.get_future().wait();
    };
  }
};

}  // namespace

TEST_CASE("work runs in the order of its arrival") {
  std::vector<int> order;
  {
    WorkerPool pool(1, {}, {});
    std::promise<void> done;
    for (int i = 0; i < 5; ++i)
      pool.submit(static_cast<std::uint64_t>(i), 1, Entry::kCall, [&, i] { order.push_back(i); });
    pool.submit(5, 1, Entry::kCall, [&] { done.set_value(); });
    done.get_future().wait();
  }
  CHECK(order == std::vector<int>{0, 1, 2, 3, 4});
}

TEST_CASE("every worker lives inside its surroundings") {
  std::atomic<int> prepared{0}, seen{0};
  {
    WorkerPool pool(1, {}, [&](const auto& serve) {
      ++prepared;
      serve();
      prepared = -1;
    });
    std::promise<void> done;
    pool.submit(1, 0, Entry::kCall, [&] {
      seen = prepared.load();
      done.set_value();
    });
    done.get_future().wait();
  }
  CHECK(seen == 1);
  CHECK(prepared == -1);
}

TEST_CASE("a full queue refuses, and withdrawing makes room") {
  Blocker blocker;
  WorkerPool pool(1, {.queue_length = 2, .queue_bytes = 100, .open_streams = 1}, {});
  REQUIRE(pool.submit(1, 10, Entry::kCall, blocker.work()).admitted);
  blocker.entered.get_future().wait();
  std::atomic<int> ran{0};
  CHECK(pool.submit(2, 60, Entry::kCall, [&] { ++ran; }).admitted);
  CHECK_FALSE(pool.submit(3, 60, Entry::kCall, [&] { ++ran; }).admitted);
  CHECK(pool.submit(4, 40, Entry::kCall, [&] { ++ran; }).admitted);
  CHECK_FALSE(pool.submit(5, 0, Entry::kCall, [&] { ++ran; }).admitted);
  CHECK(pool.load().queue_length == 2);
  CHECK(pool.load().queue_bytes == 100);
  CHECK(pool.withdraw(2));
  CHECK_FALSE(pool.withdraw(2));
  CHECK_FALSE(pool.withdraw(1));  // a worker has it
  CHECK(pool.load().queue_bytes == 40);
  std::promise<void> done;
  CHECK(pool.submit(6, 60, Entry::kCall, [&] { done.set_value(); }).admitted);
  blocker.release.set_value();
  done.get_future().wait();
  CHECK(ran == 1);
}

TEST_CASE("withdrawn work is destroyed outside the pool's lock") {
  Blocker blocker;
  WorkerPool pool(1, {}, {});
  pool.submit(1, 0, Entry::kCall, blocker.work());
  blocker.entered.get_future().wait();
  std::size_t left = 99;
  auto asks_the_pool = std::shared_ptr<int>(new int, [&](int* p) {
    delete p;
    left = pool.load().queue_length;  // deadlocks if the lock is held
  });
  pool.submit(2, 0, Entry::kCall, [asks_the_pool] {});
  asks_the_pool.reset();
  CHECK(pool.withdraw(2));
  CHECK(left == 0);
  blocker.release.set_value();
}

TEST_CASE("streams hold places until they are closed") {
  WorkerPool pool(1, {.queue_length = 1, .queue_bytes = 1, .open_streams = 1}, {});
  CHECK(pool.openStream().admitted);
  CHECK_FALSE(pool.openStream().admitted);
  pool.closeStream();
  CHECK(pool.openStream().admitted);
}
