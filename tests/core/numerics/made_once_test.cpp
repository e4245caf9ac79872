#include "core/numerics/made_once.h"

#include <catch2/catch.hpp>
#include <latch>
#include <stdexcept>
#include <thread>
#include <vector>

using namespace shaped;

namespace {

using Value = std::shared_ptr<const int>;

}  // namespace

TEST_CASE("threads that want a value at once have one made and share it") {
  const MadeOnce<int> once;
  std::atomic<int> makings = 0;
  std::vector<Value> values(8);
  {
    std::latch together(8);
    std::vector<std::jthread> threads;
    for (auto& value : values)
      threads.emplace_back([&] {
        together.arrive_and_wait();
        value = once.get({}, [&](const std::stop_token&) {
          std::this_thread::sleep_for(std::chrono::milliseconds(20));
          return std::make_shared<const int>(++makings);
        });
      });
  }
  CHECK(makings == 1);
  for (const auto& value : values) CHECK(value == values.front());
}

TEST_CASE("who is stopped while making leaves it to the next, and who waits can be stopped too") {
  const MadeOnce<int> once;
  std::stop_source maker_stop, waiter_stop;
  std::latch making(1);
  Value made = std::make_shared<const int>(0), waited = made, after;
  std::jthread maker([&] {
    made = once.get(maker_stop.get_token(), [&](const std::stop_token& stop) {
      making.count_down();
      while (!stop.stop_requested()) std::this_thread::yield();
      return Value();
    });
  });
  making.wait();
  std::jthread waiter([&] {
    waited = once.get(waiter_stop.get_token(), [](const std::stop_token&) { return std::make_shared<const int>(1); });
  });
  std::jthread patient(
      [&] { after = once.get({}, [](const std::stop_token&) { return std::make_shared<const int>(2); }); });
  waiter_stop.request_stop();
  waiter.join();
  CHECK(waited == nullptr);
  maker_stop.request_stop();
  maker.join();
  patient.join();
  CHECK(made == nullptr);
  REQUIRE(after);
  CHECK(*after == 2);
}

TEST_CASE("what making throws reaches its caller, and the next one tries again") {
  const MadeOnce<int> once;
  CHECK_THROWS_AS(once.get({}, [](const std::stop_token&) -> Value { throw std::runtime_error("no memory"); }),
                  std::runtime_error);
  const auto value = once.get({}, [](const std::stop_token&) { return std::make_shared<const int>(7); });
  REQUIRE(value);
  CHECK(*value == 7);
  CHECK(once.get({}, [](const std::stop_token&) { return std::make_shared<const int>(8); }) == value);
}
