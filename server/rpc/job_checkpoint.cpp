#include "server/rpc/job_checkpoint.h"

namespace shaped::server {

void JobCheckpoint::offer(const std::function<void(const std::filesystem::path&)>& write) {
  if (Clock::now() - kept_ < every_ && !run_.stop.stop_requested()) return;
  kept_ = Clock::now();
  try {
    write(path_);
    run_.checkpointed();
  } catch (const std::exception& problem) {
    logError("job " + run_.job.id + " goes on without a checkpoint: " + problem.what());
  }
}

}  // namespace shaped::server
