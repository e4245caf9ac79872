#include "server/models/pending_model.h"

#include <future>

namespace shaped::server {

ServedModelPtr PendingModel::get() {
  const std::scoped_lock lock(mutex_);
  if (done_) return result();
  throw Waiting([self = shared_from_this()](Waiting::Resume resume) { self->whenDone(std::move(resume)); });
}

ServedModelPtr PendingModel::wait() {
  std::promise<void> done;
  whenDone([&done] { done.set_value(); });
  done.get_future().wait();
  const std::scoped_lock lock(mutex_);
  return result();
}

void PendingModel::finish(ServedModelPtr model, std::exception_ptr failure) {
  std::vector<Waiting::Resume> waiting;
  {
    const std::scoped_lock lock(mutex_);
    done_ = true;
    model_ = std::move(model);
    failure_ = std::move(failure);
    waiting.swap(waiting_);
  }
  for (const auto& resume : waiting) resume();
}

void PendingModel::whenDone(Waiting::Resume resume) {
  {
    const std::scoped_lock lock(mutex_);
    if (!done_) return waiting_.push_back(std::move(resume));
  }
  resume();
}

ServedModelPtr PendingModel::result() const {
  if (failure_) std::rethrow_exception(failure_);
  return model_;
}

}  // namespace shaped::server
