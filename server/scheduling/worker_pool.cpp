#include "server/scheduling/worker_pool.h"

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <system_error>

namespace shaped::server {
namespace {

using Clock = std::chrono::steady_clock;

int niceOfThisThread() { return getpriority(PRIO_PROCESS, static_cast<id_t>(gettid())); }

Decision noThread() {
  return {false, RefusalCause::kMemory, "the system lets the daemon start no thread", std::chrono::seconds(1)};
}

}  // namespace

WorkerPool::WorkerPool(std::string name, int threads, AdmissionLimits limits, Around around)
    : name_(std::move(name)), around_(std::move(around)), nice_(niceOfThisThread()), queue_(threads, limits) {
  threads_.reserve(static_cast<std::size_t>(threads));
}

WorkerPool::~WorkerPool() {
  {
    const std::scoped_lock lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  for (auto& thread : threads_) thread.join();
}

/// One thread more; false where the system gives none, or the pool is about to end.
bool WorkerPool::hire() try {
  if (stopping_) return false;
  threads_.emplace_back([this] {
    pthread_setname_np(pthread_self(), name_.c_str());
    around_ ? around_([this] { serve(); }) : serve();
  });
  ++idle_;
  return true;
} catch (const std::system_error&) {
  return false;
}

/// Where there can be no thread more, those that are there work it off.
void WorkerPool::hireWhereWorkWaits() {
  const auto load = queue_.load();
  if (idle_ < load.queue_length && threads_.size() < static_cast<std::size_t>(load.workers) &&
      niceOfThisThread() <= nice_)
    hire();
}

void WorkerPool::hireFirst() {
  const std::scoped_lock lock(mutex_);
  if (!staffed()) throw std::system_error(std::make_error_code(std::errc::resource_unavailable_try_again), name_);
}

Decision WorkerPool::submit(std::uint64_t id, const Caller& caller, std::size_t bytes, Work work) {
  {
    const std::scoped_lock lock(mutex_);
    if (!staffed()) return noThread();
    auto decision = queue_.enter(id, caller, Entry::kCall, bytes);
    if (!decision.admitted) return decision;
    queue_.push(id, bytes, std::move(work), Clock::now());
    hireWhereWorkWaits();
  }
  wake_.notify_one();
  return {};
}

Decision WorkerPool::openStream(std::uint64_t id, const Caller& caller) {
  const std::scoped_lock lock(mutex_);
  if (!staffed()) return noThread();
  return queue_.enter(id, caller, Entry::kStream, 0);
}

void WorkerPool::proceed(std::uint64_t id, std::size_t bytes, Work work) {
  {
    const std::scoped_lock lock(mutex_);
    queue_.push(id, bytes, std::move(work), Clock::now());
    hireWhereWorkWaits();
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
    --idle_;
    if (stopping_) return;
    auto begun = queue_.pop(Clock::now());
    lock.unlock();
    const auto begin = Clock::now();
    begun.work();
    begun.work = nullptr;
    const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
    lock.lock();
    ++idle_;
    queue_.ended(begun.client, begun.kind, seconds);
  }
}

}  // namespace shaped::server
