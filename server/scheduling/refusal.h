#pragma once

#include <array>
#include <string_view>

namespace shaped::server {

/// Why the daemon turned something away that was not wrong in itself.
enum class RefusalCause {
  kQueueLength,  ///< too many requests wait for a worker
  kQueueBytes,   ///< their messages together are too large
  kOpenStreams,  ///< too many streams are open
  kWaitingJobs,  ///< too many jobs wait
  kStoreLock,    ///< another program keeps a file of the store locked
  kMemory,       ///< no memory for this request
  kDisk,         ///< the store's disk is full
};

inline constexpr std::array kRefusalCauses{RefusalCause::kQueueLength, RefusalCause::kQueueBytes,
                                           RefusalCause::kOpenStreams, RefusalCause::kWaitingJobs,
                                           RefusalCause::kStoreLock,   RefusalCause::kMemory,
                                           RefusalCause::kDisk};

constexpr std::string_view name(RefusalCause cause) {
  switch (cause) {
    case RefusalCause::kQueueLength:
      return "queue_length";
    case RefusalCause::kQueueBytes:
      return "queue_bytes";
    case RefusalCause::kOpenStreams:
      return "open_streams";
    case RefusalCause::kWaitingJobs:
      return "waiting_jobs";
    case RefusalCause::kStoreLock:
      return "store_lock";
    case RefusalCause::kMemory:
      return "memory";
    case RefusalCause::kDisk:
      return "disk";
  }
  return "unknown";
}

}  // namespace shaped::server
