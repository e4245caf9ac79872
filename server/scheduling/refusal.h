#pragma once

#include <array>
#include <string_view>

namespace shaped::server {

/// Why the daemon turned something away that was not wrong in itself.
enum class RefusalCause {
  kQueueLength,     ///< too many requests wait for a worker
  kBytesInFlight,   ///< the messages of all requests together are too large
  kOpenStreams,     ///< too many streams are open
  kClientRequests,  ///< too many requests of this client are in flight
  kClientBytes,     ///< their messages together are too large
  kClientStreams,   ///< too many streams of this client are open
  kDeadline,        ///< a request would not be answered before its deadline
  kWaitingJobs,     ///< too many jobs wait
  kStoreLock,       ///< another program keeps a file of the store locked
  kMemory,          ///< no memory for this request
  kDisk,            ///< the store's disk is full
};

inline constexpr std::array kRefusalCauses{
    RefusalCause::kQueueLength, RefusalCause::kBytesInFlight, RefusalCause::kOpenStreams, RefusalCause::kClientRequests,
    RefusalCause::kClientBytes, RefusalCause::kClientStreams, RefusalCause::kDeadline,    RefusalCause::kWaitingJobs,
    RefusalCause::kStoreLock,   RefusalCause::kMemory,        RefusalCause::kDisk};

constexpr std::string_view name(RefusalCause cause) {
  constexpr std::array<std::string_view, kRefusalCauses.size()> names{
      "queue_length", "bytes_in_flight", "open_streams", "client_requests", "client_bytes", "client_streams",
      "deadline",     "waiting_jobs",    "store_lock",   "memory",          "disk"};
  return names.at(static_cast<std::size_t>(cause));
}

}  // namespace shaped::server
