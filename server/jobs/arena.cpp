#include "server/jobs/arena.h"

#include <tbb/task_arena.h>
#include <tbb/task_scheduler_observer.h>

#include "core/numerics/threads.h"

namespace shaped::server {
namespace {

/// OpenMP's limit is not inherited, so every thread that joins the arena sets it for itself.
class OpenMpLimit final : public tbb::task_scheduler_observer {
 public:
  explicit OpenMpLimit(tbb::task_arena& arena) : tbb::task_scheduler_observer(arena) { observe(true); }
  ~OpenMpLimit() override { observe(false); }
  void on_scheduler_entry(bool) override { limitOpenMpInThisThread(); }
};

}  // namespace

void runInArena(int threads, const std::function<void()>& work) {
  limitOpenMpInThisThread();
  tbb::task_arena arena(threads);
  const OpenMpLimit limit(arena);
  arena.execute(work);
}

}  // namespace shaped::server
