#include "server/jobs/arena.h"

#include <sys/resource.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <map>
#include <mutex>
#include <thread>

using namespace shaped::server;

namespace {

int niceOfThisThread() { return getpriority(PRIO_PROCESS, static_cast<id_t>(gettid())); }

/// Nice of every thread that takes part in a parallel loop.
std::map<pid_t, int> niceOfAll() {
  std::mutex mutex;
  std::map<pid_t, int> seen;
  tbb::parallel_for(0, 64, [&](int) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    const std::scoped_lock lock(mutex);
    seen[gettid()] = niceOfThisThread();
  });
  return seen;
}

}  // namespace

TEST_CASE("work in the background is nice on each of its threads, and on no other") {
  const int before = niceOfThisThread();
  std::map<pid_t, int> background, foreground;
  std::thread([&] { runInBackground(2, [&] { background = niceOfAll(); }); }).join();
  std::thread([&] { runInArena(1, [&] { foreground = niceOfAll(); }); }).join();
  CHECK(background.size() <= 2);
  for (const auto& [thread, nice] : background) CHECK(nice >= std::max(before, 10));
  REQUIRE(foreground.size() == 1);
  CHECK(foreground.begin()->second == before);
  CHECK(niceOfThisThread() == before);
}
