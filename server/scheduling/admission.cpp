#include "server/scheduling/admission.h"

#include <algorithm>

namespace shaped::server {
namespace {

std::chrono::milliseconds timeToDrain(const Load& load) {
  const double waiting = static_cast<double>(load.queue_length + load.busy);
  const double seconds = load.mean_seconds * waiting / std::max(load.workers, 1);
  return std::chrono::milliseconds(static_cast<std::int64_t>(1000 * std::clamp(seconds, 0.1, 60.0)));
}

Decision refuse(const Load& load, RefusalCause cause, const std::string& reason) {
  const auto delay = timeToDrain(load);
  return {false, cause, "the server is busy: " + reason + "; try again in " + std::to_string(delay.count()) + " ms",
          delay};
}

}  // namespace

Decision admit(const Load& load, const AdmissionLimits& limits, Entry entry, std::size_t bytes) {
  if (entry == Entry::kContinuation) return {};
  if (entry == Entry::kStream && load.open_streams >= limits.open_streams)
    return refuse(load, RefusalCause::kOpenStreams, std::to_string(load.open_streams) + " streams are open");
  if (load.queue_length >= limits.queue_length)
    return refuse(load, RefusalCause::kQueueLength, std::to_string(load.queue_length) + " requests are waiting");
  if (load.queue_length > 0 && load.queue_bytes + bytes > limits.queue_bytes)
    return refuse(load, RefusalCause::kQueueBytes, std::to_string(load.queue_bytes) + " bytes of requests are waiting");
  return {};
}

}  // namespace shaped::server
