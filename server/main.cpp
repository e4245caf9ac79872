#include <iostream>
#include <thread>

#include "core/numerics/blas_kernels.h"
#include "core/numerics/error.h"
#include "core/numerics/threads.h"
#include "server/daemon/best_kernels.h"
#include "server/daemon/command_line.h"
#include "server/daemon/daemon.h"
#include "server/daemon/grpc_log.h"
#include "server/daemon/signals.h"
#include "server/daemon/supervisor.h"
#include "server/security/limits.h"
#include "server/telemetry/call_log.h"

namespace {

using namespace shaped;
using server::CommandLine;

CommandLine readCommandLine(const std::vector<std::string>& words) {
  return server::parseCommandLine(words, static_cast<int>(std::max(1U, std::thread::hardware_concurrency())));
}

/// The daemon goes on with what it has when the configuration is faulty.
void reload(server::Daemon& daemon, const std::vector<std::string>& words) try {
  daemon.reload(readCommandLine(words).options);
} catch (const std::exception& error) {
  server::logError(std::string("the configuration is not taken over: ") + error.what());
}

/// What the log still holds is written, whatever ends the program.
struct StopLogAtExit {
  ~StopLogAtExit() { server::stopLog(); }
};

int serve(const server::DaemonOptions& options, const std::vector<std::string>& words) {
  const StopLogAtExit stop_log;
  server::startLog(options.log, options.log_format);
  server::takeGrpcLog();
  server::Daemon daemon(options);
  server::logInfo("listening on " + daemon.address() + ", store " + options.store.string() + ", " +
                  std::to_string(options.threads) + " threads, OpenBLAS for " + blasKernels() +
                  (daemon.scrapeAddress().empty() ? "" : ", metrics on http://" + daemon.scrapeAddress() + "/metrics"));
  server::notifySupervisor("READY=1");
  while (server::waitForSignal() == server::Signal::kReload) reload(daemon, words);
  server::logInfo("stopping");
  server::notifySupervisor("STOPPING=1");
  daemon.announceStop();
  server::stopSignalWithin(std::chrono::duration<double>(daemon.options().drain));
  daemon.shutdown(std::chrono::duration<double>(daemon.options().grace));
  server::logInfo("stopped");
  return 0;
}

int run(const std::vector<std::string>& words) {
  const auto command = readCommandLine(words);
  switch (command.action) {
    case CommandLine::Action::kServe:
      return serve(command.options, words);
    case CommandLine::Action::kCheck:
      std::cout << server::describe(command.options) << "# in order\n";
      return 0;
    case CommandLine::Action::kHelp:
      std::cout << server::usage();
      return 0;
    case CommandLine::Action::kVersion:
      std::cout << "shaped " SHAPED_VERSION "\n";
      return 0;
  }
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  server::useBestBlasKernels();
  server::catchSignals();
  limitLibraryThreads();
  server::raiseDescriptorLimit();
  try {
    return run({argv + 1, argv + argc});
  } catch (const InvalidInput& error) {
    std::cerr << "shaped: " << error.what() << "\n";
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "shaped: " << error.what() << "\n";
    return 1;
  }
}
