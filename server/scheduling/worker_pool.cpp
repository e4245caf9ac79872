#include "server/scheduling/worker_pool.h"

#include <chrono>

namespace shaped::server {
namespace {

using Clock = std::chrono::steady_clock;

}  // namespace

WorkerPool::WorkerPool(int threads, AdmissionLimits limits, const Around& around) : queue_(threads, limits) {
  for (int i = 0; i < threads; ++i)
    threads_.emplace_back([this, around] { around ? around([this] { serve(); }) : serve(); });
}

WorkerPool::~WorkerPool() {
  {
    const std::scoped_lock lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  for (auto& thread : threads_) thread.join();
}

Decision WorkerPool::submit(std::uint64_t id, const Caller& caller, std::size_t bytes, Work work) {
  {
    const std::scoped_lock lock(mutex_);
    auto decision = queue_.enter(id, caller, Entry::kCall, bytes);
    if (!decision.admitted) return decision;
    queue_.push(id, bytes, std::move(work), Clock::now());
  }
  wake_.notify_one();
  return {};
}

Decision WorkerPool::openStream(std::uint64_t id, const Caller& caller) {
  const std::scoped_lock lock(mutex_);
  return queue_.enter(id, caller, Entry::kStream, 0);
}

void WorkerPool::proceed(std::uint64_t id, std::size_t bytes, Work work) {
  {
    const std::scoped_lock lock(mutex_);
    queue_.push(id, bytes, std::move(work), Clock::now());
  }
  wake_.notify_one();
}

bool WorkerPool::withdraw(std::uint64_t id) {
  std::optional<Work> taken;  // destroyed after the lock is released: it may own the last reference to a call
  const std::scoped_lock lock(mutex_);
  taken = queue_.withdraw(id);
  return taken.has_value();
}

void WorkerPool::leave(std::uint64_t id) {
  const std::scoped_lock lock(mutex_);
  queue_.leave(id);
}

AdmissionLimits WorkerPool::limits() const {
  const std::scoped_lock lock(mutex_);
  return queue_.limits();
}

Load WorkerPool::load() const {
  const std::scoped_lock lock(mutex_);
  return queue_.load();
}

void WorkerPool::setLimits(const AdmissionLimits& limits) {
  const std::scoped_lock lock(mutex_);
  queue_.setLimits(limits);
}

void WorkerPool::setAgeing(double seconds) {
  const std::scoped_lock lock(mutex_);
  queue_.setAgeing(seconds);
}

void WorkerPool::serve() {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return stopping_ || !queue_.empty(); });
    if (stopping_) return;
    auto begun = queue_.pop(Clock::now());
    lock.unlock();
    const auto begin = Clock::now();
    begun.work();
    begun.work = nullptr;
    const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
    lock.lock();
    queue_.ended(begun.client, begun.kind, seconds);
  }
}

}  // namespace shaped::server
