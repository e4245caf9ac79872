#include "server/jobs/job_record.h"

#include <random>

namespace shaped::server {

std::string newJobKey() {
  constexpr char digits[] = "0123456789abcdef";
  std::random_device source;
  std::string key;
  for (int i = 0; i < 32; ++i) key += digits[source() & 15U];
  return key;
}

std::string nameOf(JobState state) {
  switch (state) {
    case JobState::kQueued:
      return "queued";
    case JobState::kRunning:
      return "running";
    case JobState::kSucceeded:
      return "succeeded";
    case JobState::kFailed:
      return "failed";
    case JobState::kCancelled:
      return "cancelled";
  }
  return "unknown";
}

}  // namespace shaped::server
