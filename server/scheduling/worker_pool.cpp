#include "server/scheduling/worker_pool.h"

#include <algorithm>
#include <chrono>

namespace shaped::server {

WorkerPool::WorkerPool(int threads, AdmissionLimits limits, const Around& around) : limits_(limits) {
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

Decision WorkerPool::submit(std::uint64_t id, std::size_t bytes, Entry entry, std::function<void()> work) {
  {
    const std::scoped_lock lock(mutex_);
    auto decision = admit(loadLocked(), limits_, entry, bytes);
    if (!decision.admitted) return decision;
    queue_.push_back({id, bytes, std::move(work)});
    queue_bytes_ += bytes;
  }
  wake_.notify_one();
  return {};
}

bool WorkerPool::withdraw(std::uint64_t id) {
  Task taken;  // destroyed after the lock is released: it may own the last reference to a call
  const std::scoped_lock lock(mutex_);
  const auto found = std::find_if(queue_.begin(), queue_.end(), [id](const Task& task) { return task.id == id; });
  if (found == queue_.end()) return false;
  queue_bytes_ -= found->bytes;
  taken = std::move(*found);
  queue_.erase(found);
  return true;
}

Decision WorkerPool::openStream() {
  const std::scoped_lock lock(mutex_);
  auto decision = admit(loadLocked(), limits_, Entry::kStream, 0);
  if (decision.admitted) ++open_streams_;
  return decision;
}

void WorkerPool::closeStream() {
  const std::scoped_lock lock(mutex_);
  --open_streams_;
}

AdmissionLimits WorkerPool::limits() const {
  const std::scoped_lock lock(mutex_);
  return limits_;
}

Load WorkerPool::load() const {
  const std::scoped_lock lock(mutex_);
  return loadLocked();
}

void WorkerPool::setLimits(const AdmissionLimits& limits) {
  const std::scoped_lock lock(mutex_);
  limits_ = limits;
}

Load WorkerPool::loadLocked() const {
  return {static_cast<int>(threads_.size()), busy_, queue_.size(), queue_bytes_, open_streams_, mean_seconds_};
}

void WorkerPool::serve() {
  constexpr double memory = 0.9;  // of the moving average, per piece of work
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return stopping_ || !queue_.empty(); });
    if (stopping_) return;
    auto task = std::move(queue_.front());
    queue_.pop_front();
    queue_bytes_ -= task.bytes;
    ++busy_;
    lock.unlock();
    const auto begin = std::chrono::steady_clock::now();
    task.work();
    task.work = nullptr;
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    lock.lock();
    --busy_;
    mean_seconds_ = mean_seconds_ == 0 ? seconds : memory * mean_seconds_ + (1 - memory) * seconds;
  }
}

}  // namespace shaped::server
