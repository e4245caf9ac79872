#include "server/rpc/call_times.h"

#include <catch2/catch.hpp>
#include <thread>

using namespace shaped::server;
using namespace std::chrono_literals;
using Phase = CallTimes::Phase;

TEST_CASE("the phases of a call add up over its messages, and divide its time") {
  const auto begin = std::chrono::steady_clock::now();
  CallTimes times;
  for (int message = 0; message < 2; ++message) {
    times.enter(Phase::kQueued);
    std::this_thread::sleep_for(10ms);
    times.enter(Phase::kWorking);
    std::this_thread::sleep_for(20ms);
    times.enter(Phase::kResting);
    std::this_thread::sleep_for(5ms);
  }
  times.enter(Phase::kQueued);  // a phase that still lasts counts
  std::this_thread::sleep_for(10ms);
  const double queued = times.seconds(Phase::kQueued), worked = times.seconds(Phase::kWorking);
  const double all = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  CHECK(queued >= 0.030);
  CHECK(worked >= 0.040);
  CHECK(times.seconds(Phase::kResting) >= 0.010);
  CHECK(queued + worked + times.seconds(Phase::kResting) <= all + 1e-3);
}
