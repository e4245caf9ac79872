#include "server/rpc/call.h"

#include <algorithm>

#include "server/errors/errors.h"
#include "server/scheduling/waiting.h"
#include "server/telemetry/call_log.h"

namespace shaped::server {
namespace {

std::uint64_t nextRequestId() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

double secondsSince(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// What the caller says of its trace; nothing when it says nothing, or not exactly one valid thing.
std::optional<TraceContext> parentOf(const grpc::CallbackServerContext& context) {
  const auto [first, end] = context.client_metadata().equal_range(kTraceparent);
  if (first == end || std::next(first) != end) return std::nullopt;
  return parseTraceparent({first->second.data(), first->second.size()});
}

/// gRPC tells the deadline in the time of day, computed anew at each question: taken over at once, before that jumps.
DeadlineTimer::Clock::time_point deadlineOf(const grpc::CallbackServerContext& context) {
  using TimeOfDay = std::chrono::system_clock;
  const auto deadline = context.deadline();
  if (deadline == TimeOfDay::time_point::max()) return DeadlineTimer::Clock::time_point::max();
  return DeadlineTimer::Clock::now() + (deadline - TimeOfDay::now());
}

}  // namespace

Call::Call(const Runtime& runtime, grpc::CallbackServerContext& context, std::string method,
           std::chrono::duration<double> cap)
    : context_(context),
      client_deadline_(deadlineOf(context)),
      metrics_(runtime.metrics),
      id_(nextRequestId()),
      method_(std::move(method)),
      client_(nameOfCaller(runtime.access, context)),
      counts_(runtime.metrics.method(method_)),
      parent_(parentOf(context)),
      trace_(parent_ ? parent_->child() : newTrace()),
      cap_(cap),
      arrival_(std::chrono::steady_clock::now()),
      work_begin_(arrival_) {
  counts_.began();
  context_.AddInitialMetadata(kTraceparent, trace_.header());
}

Caller Call::caller() const {
  const std::chrono::duration<double> left = deadline() - DeadlineTimer::Clock::now();
  return {clientKey(client_, context_.peer()), priorityOf(context_), method_, left.count()};
}

void Call::throwIfStopped() const {
  if (stopped()) throw Stopped();
}

void Call::setModel(const std::string& name, std::uint64_t version) {
  const std::scoped_lock lock(model_mutex_);
  model_ = name + "@" + std::to_string(version);
}

double Call::workSeconds() const { return secondsSince(work_begin_); }

grpc::Status Call::guarded(const std::function<void()>& work) {
  work_begin_ = std::chrono::steady_clock::now();
  times_.enter(CallTimes::Phase::kWorking);
  grpc::Status status;
  try {
    throwIfStopped();
    priorityOf(context_);
    work();
  } catch (const Waiting&) {
    times_.enter(CallTimes::Phase::kResting);
    throw;
  } catch (...) {
    if (const auto cause = refusalCauseOf(std::current_exception())) metrics_.refused(*cause);
    status = statusOf(std::current_exception(), stopper_.reason());
  }
  times_.enter(CallTimes::Phase::kResting);
  return status;
}

void Call::waitForClient(const std::function<void()>& wait) {
  times_.enter(CallTimes::Phase::kResting);
  wait();
  times_.enter(CallTimes::Phase::kWorking);
}

void Call::stop(StopReason reason) {
  // When the client's deadline passes, gRPC reports a cancellation, a little early: the client's clock started first.
  constexpr auto slack = std::chrono::milliseconds(50);
  const bool late = client_deadline_ - slack <= DeadlineTimer::Clock::now();
  stopper_.stop(late ? StopReason::kDeadline : reason);
}

grpc::Status Call::refusal(const Decision& decision) {
  metrics_.refused(decision.cause);
  context_.AddTrailingMetadata("grpc-retry-pushback-ms", std::to_string(decision.retry_after.count()));
  return statusOf(
      ErrorReport{grpc::RESOURCE_EXHAUSTED, decision.reason, reasonOf(decision.cause), {}, decision.retry_after});
}

DeadlineTimer::Clock::time_point Call::deadline() const {
  const auto cap = std::chrono::duration_cast<DeadlineTimer::Clock::duration>(cap_);
  return std::min(client_deadline_, DeadlineTimer::Clock::now() + cap);
}

bool Call::finishOnce(const grpc::Status& status) {
  if (finished_.exchange(true)) return false;
  CallRecord record{.request_id = id_,
                    .method = method_,
                    .client = client_,
                    .model = {},
                    .outcome = nameOf(status.error_code()),
                    .message = status.error_message(),
                    .seconds = secondsSince(arrival_),
                    .queue_seconds = times_.seconds(CallTimes::Phase::kQueued),
                    .compute_seconds = times_.seconds(CallTimes::Phase::kWorking),
                    .peer = context_.peer(),
                    .trace = trace_,
                    .parent_id = parent_ ? parent_->span_id : ""};
  {
    const std::scoped_lock lock(model_mutex_);
    record.model = model_;
  }
  counts_.ended({record.outcome, record.seconds, record.queue_seconds, record.compute_seconds});
  logCall(record, serversFault(status.error_code()));
  return true;
}

}  // namespace shaped::server
