#include <semaphore.h>

#include <cerrno>
#include <csignal>
#include <iostream>
#include <thread>

#include "core/numerics/error.h"
#include "core/numerics/threads.h"
#include "server/daemon/daemon.h"
#include "server/telemetry/call_log.h"

namespace {

using namespace shaped;

sem_t stop_asked;

// Handlers, not a signal mask with sigwait: libraries start threads before main, which no mask of ours reaches.
void stopOnSignals() {
  sem_init(&stop_asked, 0, 0);
  struct sigaction action {};
  action.sa_handler = [](int) { sem_post(&stop_asked); };
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  // A file over the size limit is an error to report, not to die of.
  signal(SIGXFSZ, SIG_IGN);
}

int serve(const server::DaemonOptions& options) {
  server::startLog(options.log);
  server::Daemon daemon(options);
  server::logInfo("listening on " + daemon.address() + ", store " + options.store.string() + ", " +
                  std::to_string(options.threads) + " threads");
  while (sem_wait(&stop_asked) != 0 && errno == EINTR) {
  }
  server::logInfo("stopping");
  daemon.shutdown(std::chrono::seconds(5));
  server::logInfo("stopped");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  stopOnSignals();
  limitLibraryThreads();
  try {
    const auto processors = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
    const auto options = server::parseOptions({argv + 1, argv + argc}, processors);
    if (!options) {
      std::cout << server::usage();
      return 0;
    }
    return serve(*options);
  } catch (const InvalidInput& error) {
    std::cerr << "shaped: " << error.what() << "\n";
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "shaped: " << error.what() << "\n";
    return 1;
  }
}
