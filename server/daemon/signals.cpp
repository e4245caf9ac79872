#include "server/daemon/signals.h"

#include <semaphore.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <ctime>

namespace shaped::server {
namespace {

// Counts the signals that are still to be taken from the flags.
sem_t arrived;
std::atomic<int> stops{0}, reloads{0};
static_assert(std::atomic<int>::is_always_lock_free, "signal handlers may touch nothing else");

void handle(int signal) {
  ++(signal == SIGHUP ? reloads : stops);
  sem_post(&arrived);
}

bool take(std::atomic<int>& count) {
  int seen = count;
  while (seen > 0 && !count.compare_exchange_weak(seen, seen - 1)) {
  }
  return seen > 0;
}

timespec fromNow(std::chrono::duration<double> time) {
  timespec at{};
  clock_gettime(CLOCK_MONOTONIC, &at);
  const auto nanoseconds = std::chrono::duration_cast<std::chrono::nanoseconds>(time).count() + at.tv_nsec;
  at.tv_sec += nanoseconds / 1'000'000'000;
  at.tv_nsec = nanoseconds % 1'000'000'000;
  return at;
}

}  // namespace

// Handlers, not a signal mask with sigwait: libraries start threads before main, which no mask of ours reaches.
void catchSignals() {
  sem_init(&arrived, 0, 0);
  struct sigaction action {};
  action.sa_handler = handle;
  action.sa_flags = SA_RESTART;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaction(signal, &action, nullptr);
  std::signal(SIGXFSZ, SIG_IGN);
  // Neither is a reader of the log that has gone.
  std::signal(SIGPIPE, SIG_IGN);
}

Signal waitForSignal() {
  while (true) {
    if (take(stops)) return Signal::kStop;
    if (take(reloads)) return Signal::kReload;
    sem_wait(&arrived);
  }
}

bool stopSignalWithin(std::chrono::duration<double> time) {
  const auto end = fromNow(time);
  while (!take(stops))
    if (sem_clockwait(&arrived, CLOCK_MONOTONIC, &end) != 0 && errno == ETIMEDOUT) return take(stops);
  return true;
}

}  // namespace shaped::server
