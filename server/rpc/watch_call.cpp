#include "server/rpc/watch_call.h"

#include "server/convert/job.h"
#include "server/rpc/wait_call.h"

namespace shaped::server {
namespace {

constexpr std::size_t kNewsAtOnce = 1000;  ///< a message stays small

}  // namespace

WatchCall::WatchCall(Runtime& runtime, JobRegistry& registry, const JobRunner& runner,
                     grpc::CallbackServerContext& context, std::string job, std::stop_token stop)
    : registry_(registry),
      runner_(runner),
      call_(runtime, context, "Jobs.Watch", runtime.longest_call),
      job_(std::move(job)),
      stop_(std::move(stop)) {}

void WatchCall::enter(const v1::WatchJobRequest& request) {
  self_ = shared_from_this();
  const auto status = call_.guarded([&] {
    requireWellFormed(request);
    listener_ = registry_.listen(job_, [weak = weak_from_this()] {
      if (const auto self = weak.lock()) self->onChange();
    });
  });
  status.ok() ? onChange() : end(status);
  on_daemon_stops_.emplace(stop_, [weak = weak_from_this()] {
    if (const auto self = weak.lock()) self->onDaemonStops();
  });
}

void WatchCall::onDaemonStops() {
  const std::scoped_lock lock(mutex_);
  // What is being written goes first; OnWriteDone sees the stop.
  if (!writing_) end(daemonStops(job_));
}

void WatchCall::onChange() {
  const std::scoped_lock lock(mutex_);
  changed_ = true;
  if (!writing_) writeNext();
}

void WatchCall::writeNext() {
  if (last_) return;
  changed_ = false;
  const auto status = call_.guarded([this] {
    message_.Clear();
    const auto record = registry_.get(job_);
    const bool more = addNews();
    if (more) changed_ = true;
    last_ = hasEnded(record.state) && !more;
    toProto(record, *message_.mutable_job());
  });
  if (!status.ok()) return end(status);
  writing_ = true;
  StartWrite(&message_);
}

/// Whether there may be more.
bool WatchCall::addNews() {
  if (!news_) news_ = runner_.newsOf(job_);
  if (!news_) return false;
  const auto items = news_->from(told_, kNewsAtOnce);
  for (const auto& item : items) message_.MergeFromString(item);
  told_ += items.size();
  return items.size() == kNewsAtOnce;
}

void WatchCall::OnWriteDone(bool ok) {
  const std::scoped_lock lock(mutex_);
  writing_ = false;
  if (!ok) call_.stop(StopReason::kClient);
  if (call_.stopped()) return end(call_.stopStatus());
  if (last_) return end(grpc::Status::OK);
  if (stop_.stop_requested()) return end(daemonStops(job_));
  if (changed_) writeNext();
}

void WatchCall::end(const grpc::Status& status) {
  last_ = true;
  if (call_.finishOnce(status)) Finish(status);
}

void WatchCall::OnCancel() {
  const std::scoped_lock lock(mutex_);
  call_.stop(StopReason::kClient);
  if (!writing_) end(call_.stopStatus());  // else OnWriteDone does
}

void WatchCall::OnDone() {
  listener_.reset();
  on_daemon_stops_.reset();
  const auto self = std::move(self_);
}

}  // namespace shaped::server
