#include "client/shapectl/interrupt.h"

#include <semaphore.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>

#include "client/shapectl/exit_code.h"

namespace shaped::shapectl {
namespace {

// A stop token's callbacks may not run in a signal handler; posting a semaphore may.
sem_t wake_up;
std::atomic<int> signals{0};
std::atomic<bool> finished{false};

void onSignal(int) {
  if (++signals > 1) _exit(static_cast<int>(ExitCode::kCancelled));
  sem_post(&wake_up);
}

void handle(int signal) {
  struct sigaction before {};
  sigaction(signal, nullptr, &before);
  if (before.sa_handler == SIG_IGN) return;
  struct sigaction action {};
  action.sa_handler = onSignal;
  action.sa_flags = SA_RESTART;
  sigaction(signal, &action, nullptr);
}

}  // namespace

Interrupt::Interrupt() {
  sem_init(&wake_up, 0, 0);
  thread_ = std::thread([this] {
    while (sem_wait(&wake_up) != 0 && errno == EINTR) {
    }
    if (!finished) source_.request_stop();
  });
  handle(SIGINT);
  handle(SIGTERM);
}

Interrupt::~Interrupt() {
  finished = true;
  sem_post(&wake_up);
  thread_.join();
}

}  // namespace shaped::shapectl
