#pragma once

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <stop_token>

namespace shaped {

/// What whoever first wants it makes, and all share from then on; who is stopped on the way leaves it to the next.
template <class T>
class MadeOnce {
 public:
  /// make(stop): a std::shared_ptr<const T>, null only once the token has fired; must not start parallel loops, in
  /// which the thread could come to wait for itself. Null when this caller's token fired before the value was there.
  /// What make throws goes to its caller, and the next tries again.
  template <class Make>
  std::shared_ptr<const T> get(const std::stop_token& stop, const Make& make) const {
    if (there_) return value_;
    std::unique_lock lock(mutex_);
    if (!changed_.wait(lock, stop, [&] { return there_ || !busy_; })) return nullptr;
    if (there_) return value_;
    busy_ = true;
    lock.unlock();
    const Finished finished{*this};
    auto value = make(stop);
    if (!value) return nullptr;
    value_ = std::move(value);
    there_ = true;
    return value_;
  }

 private:
  /// Lets the others go on however the making ended.
  struct Finished {
    const MadeOnce& owner;
    ~Finished() {
      const std::lock_guard lock(owner.mutex_);
      owner.busy_ = false;
      owner.changed_.notify_all();
    }
  };

  mutable std::mutex mutex_;
  mutable std::condition_variable_any changed_;
  mutable bool busy_ = false;
  mutable std::atomic<bool> there_ = false;
  mutable std::shared_ptr<const T> value_;  ///< not changed once it is there
};

}  // namespace shaped
