#include "server/jobs/arena.h"

#include <sys/resource.h>
#include <tbb/task_arena.h>
#include <tbb/task_scheduler_observer.h>
#include <unistd.h>

#include "core/numerics/threads.h"

namespace shaped::server {
namespace {

/// On Linux nice belongs to a thread. It can always go up, and without privileges never down again.
void giveWay() {
  constexpr int nice = 10;
  const auto self = static_cast<id_t>(gettid());
  if (getpriority(PRIO_PROCESS, self) < nice) setpriority(PRIO_PROCESS, self, nice);
}

/// Nothing of this is inherited, so every thread that joins the arena sets it for itself.
class ThreadSettings final : public tbb::task_scheduler_observer {
 public:
  ThreadSettings(tbb::task_arena& arena, bool background)
      : tbb::task_scheduler_observer(arena), background_(background) {
    observe(true);
  }
  ~ThreadSettings() override { observe(false); }
  void on_scheduler_entry(bool) override {
    limitOpenMpInThisThread();
    if (background_) giveWay();
  }

 private:
  const bool background_;
};

void runIn(int threads, bool background, const std::function<void()>& work) {
  limitOpenMpInThisThread();
  if (background) giveWay();
  tbb::task_arena arena(threads);
  const ThreadSettings settings(arena, background);
  arena.execute(work);
}

}  // namespace

void runInArena(int threads, const std::function<void()>& work) { runIn(threads, false, work); }
void runInBackground(int threads, const std::function<void()>& work) { runIn(threads, true, work); }

}  // namespace shaped::server
