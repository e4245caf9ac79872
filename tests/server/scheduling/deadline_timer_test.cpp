#include "server/scheduling/deadline_timer.h"

#include <catch2/catch.hpp>
#include <future>

#include "server/scheduling/stopper.h"

using namespace shaped::server;
using namespace std::chrono_literals;

static_assert(DeadlineTimer::Clock::is_steady, "whoever sets the time of day must not move deadlines");

TEST_CASE("callbacks run at their time, the earlier first whatever the order of scheduling") {
  DeadlineTimer timer;
  std::mutex mutex;
  std::vector<int> order;
  std::promise<void> done;
  const auto now = DeadlineTimer::Clock::now();
  timer.schedule(now + 60ms, [&] {
    const std::scoped_lock lock(mutex);
    order.push_back(2);
    done.set_value();
  });
  timer.schedule(now + 20ms, [&] {
    const std::scoped_lock lock(mutex);
    order.push_back(1);
  });
  done.get_future().wait();
  CHECK(DeadlineTimer::Clock::now() >= now + 60ms);
  const std::scoped_lock lock(mutex);
  CHECK(order == std::vector<int>{1, 2});
}

TEST_CASE("a cancelled callback does not run, one that is due runs at once") {
  DeadlineTimer timer;
  std::promise<void> done;
  bool ran = false;
  const auto soon = DeadlineTimer::Clock::now() + 30ms;
  timer.cancel(timer.schedule(soon, [&] { ran = true; }));
  timer.schedule(soon + 30ms, [&] { done.set_value(); });
  timer.schedule(soon - 1h, [] {});
  done.get_future().wait();
  CHECK_FALSE(ran);
}

TEST_CASE("a stopper keeps the first reason") {
  Stopper stopper;
  const auto token = stopper.token();
  CHECK_FALSE(token.stop_requested());
  CHECK(stopper.stop(StopReason::kDeadline));
  CHECK_FALSE(stopper.stop(StopReason::kClient));
  CHECK(stopper.reason() == StopReason::kDeadline);
  CHECK(token.stop_requested());
}
