#pragma once

#include <chrono>
#include <cstddef>
#include <string>

#include "server/scheduling/refusal.h"

namespace shaped::server {

/// How much may wait and stay open at once.
struct AdmissionLimits {
  std::size_t queue_length = 256;         ///< requests that wait for a worker, >= 1
  std::size_t queue_bytes = 512UL << 20;  ///< their messages together [bytes], >= 1
  std::size_t open_streams = 64;          ///< streams that may queue one message each beside these limits, >= 1
};

/// A snapshot of a worker pool.
struct Load {
  int workers = 1;
  std::size_t busy = 0;  ///< workers that run something
  std::size_t queue_length = 0;
  std::size_t queue_bytes = 0;
  std::size_t open_streams = 0;
  double mean_seconds = 0;  ///< moving average of the time that one piece of work takes
};

/// What asks to enter.
enum class Entry {
  kCall,          ///< a request of its own
  kStream,        ///< a new stream: admitted once, holds a place until it ends
  kContinuation,  ///< the next message of an admitted stream
};

struct Decision {
  bool admitted = true;
  RefusalCause cause{};                      ///< when refused
  std::string reason;                        ///< for people, when refused
  std::chrono::milliseconds retry_after{0};  ///< when to try again, if refused
};

/// Whether to let something of `bytes` enter. A call or stream enters while the queue is under both limits; one that is
/// larger than the byte limit enters an empty queue. An admitted stream is never broken off: its continuations enter
/// always, which is bounded because each stream has at most one message in work.
/// The retry delay is the time until the queue has drained, at least 0.1 and at most 60 s.
Decision admit(const Load& load, const AdmissionLimits& limits, Entry entry, std::size_t bytes);

}  // namespace shaped::server
