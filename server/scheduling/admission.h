#pragma once

#include <chrono>
#include <cstddef>
#include <limits>
#include <string>

#include "server/scheduling/priority.h"
#include "server/scheduling/refusal.h"

namespace shaped::server {

/// How much may wait, be in flight and stay open at once. In flight is what waits and what runs.
struct AdmissionLimits {
  std::size_t queue_length = 256;             ///< requests that wait for a worker, >= 1
  std::size_t bytes_in_flight = 512UL << 20;  ///< messages of all requests together [bytes], >= 1
  std::size_t open_streams = 64;              ///< streams that may queue one message each beside these limits, >= 1
  // Of one client: half of the above, so that no client alone can shut out the others.
  std::size_t client_requests = 128;       ///< requests in flight, >= 1
  std::size_t client_bytes = 256UL << 20;  ///< their messages together [bytes], >= 1
  std::size_t client_streams = 32;         ///< open streams, >= 1
};

/// For work that comes from the daemon itself.
AdmissionLimits noLimits();

/// A snapshot of a worker pool.
struct Load {
  int workers = 1;
  std::size_t busy = 0;  ///< workers that run something
  std::size_t queue_length = 0;
  std::size_t bytes_in_flight = 0;
  std::size_t open_streams = 0;
  double mean_seconds = 0;  ///< moving average of the time that one piece of work takes
};

/// What one client has in that pool.
struct ClientLoad {
  std::size_t requests = 0;  ///< that wait or run, without messages of streams
  std::size_t bytes = 0;     ///< of messages that wait or run
  std::size_t streams = 0;   ///< open
};

/// What asks to enter.
enum class Entry {
  kCall,    ///< a request of its own
  kStream,  ///< a new stream: admitted once, holds a place until it ends; its messages are not asked about
};

struct Arrival {
  Entry entry = Entry::kCall;
  Priority priority = Priority::kNormal;
  std::size_t bytes = 0;                                       ///< of the message
  double time_left = std::numeric_limits<double>::infinity();  ///< of a call, until its deadline [s]
  // By what the like took lately; 0 where nothing is known.
  double wait = 0;  ///< until a worker takes it up [s]
  double work = 0;  ///< of that worker [s]
};

struct Decision {
  bool admitted = true;
  RefusalCause cause{};                      ///< when refused
  std::string reason;                        ///< for people, when refused
  std::chrono::milliseconds retry_after{0};  ///< when to try again, if refused
};

/// How many requests may wait when one of this priority enters: less urgent ones leave an eighth (normal) or a half
/// (batch) of the queue to those above them.
std::size_t queueLengthFor(Priority priority, const AdmissionLimits& limits);

/// Whether to let something enter. The client's own limits are looked at first, then those of all. A message that is
/// larger than a byte limit enters where nothing else counts towards it. An admitted stream is never broken off: its
/// messages enter always, which is bounded because each stream has at most one in work. A call that would have to wait,
/// and would likely not be answered before its deadline, is refused while its client can still go elsewhere: work on
/// it would be lost, and in an overload all work would be of that kind.
/// The retry delay is the time until what is in the way has drained, at least 0.1 and at most 60 s.
Decision admit(const Load& load, const ClientLoad& client, const AdmissionLimits& limits, const Arrival& arrival);

}  // namespace shaped::server
