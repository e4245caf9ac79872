#include "server/scheduling/admission.h"

#include <algorithm>
#include <limits>
#include <optional>

namespace shaped::server {
namespace {

/// How long the workers take for `pieces` of work.
std::chrono::milliseconds timeToDrain(const Load& load, std::size_t pieces) {
  const double seconds = load.mean_seconds * static_cast<double>(pieces) / std::max(load.workers, 1);
  return std::chrono::milliseconds(static_cast<std::int64_t>(1000 * std::clamp(seconds, 0.1, 60.0)));
}

std::string count(std::size_t number, const std::string& what) { return std::to_string(number) + " " + what; }

Decision refuse(std::chrono::milliseconds delay, RefusalCause cause, const std::string& reason) {
  return {false, cause, reason + "; try again in " + std::to_string(delay.count()) + " ms", delay};
}

bool tooLarge(std::size_t there, std::size_t more, std::size_t limit) { return there > 0 && there + more > limit; }

/// What took so long lately may take longer now: whoever is let in is to be answered in time.
constexpr double kCaution = 1.5;

bool tooLate(const Arrival& arrival) {
  return arrival.wait > 0 && kCaution * (arrival.wait + arrival.work) > arrival.time_left;
}

std::string seconds(double time) {
  return std::to_string(static_cast<std::int64_t>(1000 * std::max(time, 0.0))) + " ms";
}

std::optional<Decision> refusalOfClient(const Load& load, const ClientLoad& client, const AdmissionLimits& limits,
                                        const Arrival& arrival) {
  const auto no = [&](RefusalCause cause, const std::string& what) {
    return refuse(timeToDrain(load, client.requests), cause, "this client has its share: " + what);
  };
  if (arrival.entry == Entry::kStream) {
    if (client.streams < limits.client_streams) return std::nullopt;
    return no(RefusalCause::kClientStreams, count(client.streams, "of its streams are open"));
  }
  if (client.requests >= limits.client_requests)
    return no(RefusalCause::kClientRequests, count(client.requests, "of its requests wait or run"));
  if (tooLarge(client.bytes, arrival.bytes, limits.client_bytes))
    return no(RefusalCause::kClientBytes, count(client.bytes, "bytes of its requests wait or run"));
  return std::nullopt;
}

std::optional<Decision> refusalOfAll(const Load& load, const AdmissionLimits& limits, const Arrival& arrival) {
  const auto no = [&](RefusalCause cause, const std::string& what) {
    return refuse(timeToDrain(load, load.queue_length + load.busy), cause, "the server is busy: " + what);
  };
  if (arrival.entry == Entry::kStream && load.open_streams >= limits.open_streams)
    return no(RefusalCause::kOpenStreams, count(load.open_streams, "streams are open"));
  const auto length = queueLengthFor(arrival.priority, limits);
  if (load.queue_length >= length)
    return no(RefusalCause::kQueueLength,
              count(load.queue_length, "requests are waiting") +
                  (length < limits.queue_length ? ", and " + count(length, "may when one of priority ") +
                                                      std::string(name(arrival.priority)) + " enters"
                                                : ""));
  if (arrival.entry == Entry::kCall && tooLarge(load.bytes_in_flight, arrival.bytes, limits.bytes_in_flight))
    return no(RefusalCause::kBytesInFlight, count(load.bytes_in_flight, "bytes of requests wait or run"));
  if (arrival.entry == Entry::kCall && tooLate(arrival))
    return no(RefusalCause::kDeadline, "its deadline comes in " + seconds(arrival.time_left) +
                                           ", and it would wait some " + seconds(arrival.wait) + " for a worker");
  return std::nullopt;
}

}  // namespace

AdmissionLimits noLimits() {
  constexpr auto most = std::numeric_limits<std::size_t>::max();
  return {most, most, most, most, most, most};
}

std::size_t queueLengthFor(Priority priority, const AdmissionLimits& limits) {
  const auto all = limits.queue_length;
  switch (priority) {
    case Priority::kInteractive:
      return all;
    case Priority::kNormal:
      return all - all / 8;
    case Priority::kBatch:
      return all - all / 2;
  }
  return all;
}

Decision admit(const Load& load, const ClientLoad& client, const AdmissionLimits& limits, const Arrival& arrival) {
  if (const auto refusal = refusalOfClient(load, client, limits, arrival)) return *refusal;
  if (const auto refusal = refusalOfAll(load, limits, arrival)) return *refusal;
  return {};
}

}  // namespace shaped::server
