#include "client/shapectl/interrupt.h"

#include <unistd.h>

#include <csignal>

#include "client/shapectl/exit_code.h"

namespace shaped::shapectl {
namespace {

// SIGUSR1 is ours alone: it ends the waiting thread when the program is done.
sigset_t handledSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, SIGUSR1}) sigaddset(&signals, signal);
  return signals;
}

}  // namespace

Interrupt::Interrupt() {
  const auto signals = handledSignals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  thread_ = std::thread([this] { waitForSignals(); });
}

Interrupt::~Interrupt() {
  pthread_kill(thread_.native_handle(), SIGUSR1);
  thread_.join();
}

void Interrupt::waitForSignals() {
  const auto signals = handledSignals();
  for (int signal = 0; sigwait(&signals, &signal) == 0 && signal != SIGUSR1;)
    if (!source_.request_stop()) _exit(static_cast<int>(ExitCode::kCancelled));
}

}  // namespace shaped::shapectl
