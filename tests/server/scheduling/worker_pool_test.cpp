#include "server/scheduling/worker_pool.h"

#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <future>
#include <memory>

using namespace shaped::server;

namespace {

const Caller ann{"ann"};

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
    WorkerPool pool("test", 1, {}, {});
    std::promise<void> done;
    for (int i = 0; i < 5; ++i) pool.submit(static_cast<std::uint64_t>(i), ann, 1, [&, i] { order.push_back(i); });
    pool.submit(5, ann, 1, [&] { done.set_value(); });
    done.get_future().wait();
  }
  CHECK(order == std::vector<int>{0, 1, 2, 3, 4});
}

TEST_CASE("every worker lives inside its surroundings") {
  std::atomic<int> prepared{0}, seen{0};
  {
    WorkerPool pool("test", 1, {}, [&](const auto& serve) {
      ++prepared;
      serve();
      prepared = -1;
    });
    std::promise<void> done;
    pool.submit(1, ann, 0, [&] {
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
  WorkerPool pool("test", 1, {.queue_length = 2, .bytes_in_flight = 110}, {});
  REQUIRE(pool.submit(1, ann, 10, blocker.work()).admitted);
  blocker.entered.get_future().wait();
  std::atomic<int> ran{0};
  CHECK(pool.submit(2, ann, 60, [&] { ++ran; }).admitted);
  CHECK_FALSE(pool.submit(3, ann, 60, [&] { ++ran; }).admitted);
  CHECK(pool.submit(4, ann, 40, [&] { ++ran; }).admitted);
  CHECK_FALSE(pool.submit(5, ann, 0, [&] { ++ran; }).admitted);
  CHECK(pool.load().queue_length == 2);
  CHECK(pool.load().bytes_in_flight == 110);
  CHECK(pool.withdraw(2));
  CHECK_FALSE(pool.withdraw(2));
  CHECK_FALSE(pool.withdraw(1));  // a worker has it
  pool.leave(2);
  CHECK(pool.load().bytes_in_flight == 50);
  std::promise<void> done;
  CHECK(pool.submit(6, ann, 60, [&] { done.set_value(); }).admitted);
  blocker.release.set_value();
  done.get_future().wait();
  CHECK(ran == 1);
}

TEST_CASE("withdrawn work is destroyed outside the pool's lock") {
  Blocker blocker;
  WorkerPool pool("test", 1, {}, {});
  pool.submit(1, ann, 0, blocker.work());
  blocker.entered.get_future().wait();
  std::size_t left = 99;
  auto asks_the_pool = std::shared_ptr<int>(new int, [&](int* p) {
    delete p;
    left = pool.load().queue_length;  // deadlocks if the lock is held
  });
  pool.submit(2, ann, 0, [asks_the_pool] {});
  asks_the_pool.reset();
  CHECK(pool.withdraw(2));
  CHECK(left == 0);
  blocker.release.set_value();
}

TEST_CASE("streams hold places until they leave") {
  WorkerPool pool("test", 1, {.queue_length = 1, .bytes_in_flight = 1, .open_streams = 1}, {});
  CHECK(pool.openStream(1, ann).admitted);
  CHECK_FALSE(pool.openStream(2, ann).admitted);
  std::promise<void> done;
  pool.proceed(1, 1000, [&] { done.set_value(); });
  done.get_future().wait();
  pool.leave(2);  // has none
  CHECK_FALSE(pool.openStream(2, ann).admitted);
  pool.leave(1);
  CHECK(pool.openStream(2, ann).admitted);
}

TEST_CASE("who calls from a worker's own work finds the pool open") {
  WorkerPool pool("test", 1, {}, {});
  std::promise<void> done;
  pool.submit(1, ann, 0, [&] {
    pool.leave(1);
    pool.submit(2, ann, 0, [&] { done.set_value(); });
  });
  CHECK(done.get_future().wait_for(std::chrono::seconds(60)) == std::future_status::ready);
}

TEST_CASE("a pool starts a thread when work waits and none is free") {
  std::atomic<int> started{0};
  Blocker first, second;
  WorkerPool pool("test", 2, {}, [&](const auto& serve) {
    ++started;
    serve();
  });
  CHECK(started == 0);
  pool.submit(1, ann, 0, first.work());
  first.entered.get_future().wait();
  CHECK(started == 1);
  pool.submit(2, ann, 0, second.work());
  second.entered.get_future().wait();
  CHECK(started == 2);
  std::promise<void> done;
  pool.submit(3, ann, 0, [&] { done.set_value(); });  // no third: it waits
  CHECK(pool.load().queue_length == 1);
  first.release.set_value();
  done.get_future().wait();
  CHECK(started == 2);
  second.release.set_value();
}

TEST_CASE("one after the other needs one thread") {
  std::atomic<int> started{0};
  WorkerPool pool("test", 3, {}, [&](const auto& serve) {
    ++started;
    serve();
  });
  for (std::uint64_t i = 0; i < 20; ++i) {
    std::promise<void> done;
    pool.submit(i, ann, 0, [&] { done.set_value(); });
    done.get_future().wait();
    while (pool.load().busy > 0) std::this_thread::yield();  // the thread is free again
  }
  CHECK(started == 1);
}

TEST_CASE("who gives way to others starts the first thread at most") {
  std::atomic<int> started{0};
  Blocker first;
  WorkerPool pool("test", 2, {}, [&](const auto& serve) {
    ++started;
    serve();
  });
  pool.hireFirst();
  pool.submit(1, ann, 0, first.work());
  first.entered.get_future().wait();
  const auto submitFrom = [&](int nice, std::uint64_t id, std::function<void()> work) {
    std::thread([&pool, nice, id, work = std::move(work)] {
      setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), nice);
      pool.submit(id, ann, 0, work);
    }).join();
  };
  submitFrom(getpriority(PRIO_PROCESS, 0) + 1, 2, [] {});
  CHECK(started == 1);
  std::promise<void> done;
  submitFrom(getpriority(PRIO_PROCESS, 0), 3, [&] { done.set_value(); });
  CHECK(done.get_future().wait_for(std::chrono::seconds(60)) == std::future_status::ready);
  CHECK(started == 2);
  first.release.set_value();
}
