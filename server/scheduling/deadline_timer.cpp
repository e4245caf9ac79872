#include "server/scheduling/deadline_timer.h"

namespace shaped::server {

DeadlineTimer::DeadlineTimer() : thread_([this] { serve(); }) {}

DeadlineTimer::~DeadlineTimer() {
  {
    const std::scoped_lock lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

DeadlineTimer::Id DeadlineTimer::schedule(Clock::time_point when, std::function<void()> callback) {
  const std::scoped_lock lock(mutex_);
  const Id id{when, next_++};
  const bool first = pending_.empty() || id < pending_.begin()->first;
  pending_.emplace(id, std::move(callback));
  if (first) wake_.notify_one();
  return id;
}

void DeadlineTimer::cancel(const Id& id) {
  std::function<void()> dropped;  // destroyed after the lock is released: it may own the last reference to a call
  const std::scoped_lock lock(mutex_);
  const auto found = pending_.find(id);
  if (found == pending_.end()) return;
  dropped = std::move(found->second);
  pending_.erase(found);
}

void DeadlineTimer::serve() {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    if (pending_.empty()) {
      wake_.wait(lock);
    } else if (pending_.begin()->first.first > Clock::now()) {
      // A copy: the entry may go while we wait.
      const auto when = pending_.begin()->first.first;
      wake_.wait_until(lock, when);
    } else {
      auto due = pending_.extract(pending_.begin());
      lock.unlock();
      due.mapped()();
      due.mapped() = nullptr;
      lock.lock();
    }
  }
}

}  // namespace shaped::server
