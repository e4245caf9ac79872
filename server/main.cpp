#include <csignal>
#include <iostream>
#include <thread>

#include "core/numerics/error.h"
#include "core/numerics/threads.h"
#include "server/daemon/daemon.h"
#include "server/telemetry/call_log.h"

namespace {

using namespace shaped;

int serve(const server::DaemonOptions& options, const sigset_t& signals) {
  server::startLog(options.log);
  server::Daemon daemon(options);
  server::logInfo("listening on " + daemon.address() + ", store " + options.store.string() + ", " +
                  std::to_string(options.threads) + " threads");
  int signal = 0;
  sigwait(&signals, &signal);
  server::logInfo("stopping");
  daemon.shutdown(std::chrono::seconds(5));
  server::logInfo("stopped");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  // Before any thread: all of them leave the signals to sigwait.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  limitLibraryThreads();
  try {
    const auto processors = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
    const auto options = server::parseOptions({argv + 1, argv + argc}, processors);
    if (!options) {
      std::cout << server::usage();
      return 0;
    }
    return serve(*options, signals);
  } catch (const InvalidInput& error) {
    std::cerr << "shaped: " << error.what() << "\n";
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "shaped: " << error.what() << "\n";
    return 1;
  }
}
