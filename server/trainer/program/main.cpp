// shaped-trainer [--parent PID] FOLDER: does the job in the folder (server/trainer/job_spec.h), and writes what happens
// to standard output, a JSON object a line (server/trainer/trainer.h). SIGTERM and SIGINT: writes a checkpoint and
// stops. With --parent it does so, too, when the thread that started it ends, and PID is the number of that one's
// process. Ends with 0 when the job is done, 2 for a bad job, whose text is on standard error, 3 when stopped, 1
// otherwise.
#include <sys/prctl.h>
#include <unistd.h>

#include <csignal>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/numerics/error.h"
#include "core/numerics/threads.h"
#include "server/daemon/best_kernels.h"
#include "server/daemon/signals.h"
#include "server/trainer/trainer.h"

namespace {

using namespace shaped;

/// Hands a signal on as a request to stop, until it is itself asked to end.
void watchSignals(const std::stop_token& end, std::stop_source job) {
  while (!end.stop_requested())
    if (server::stopSignalWithin(std::chrono::milliseconds(50))) return void(job.request_stop());
}

struct CommandLine {
  std::string folder;
  std::optional<std::string> parent;
};

std::optional<CommandLine> parse(const std::vector<std::string>& words) {
  const bool attached = words.size() == 3 && words[0] == "--parent";
  if ((!attached && words.size() != 1) || words.back().starts_with("-")) return std::nullopt;
  return CommandLine{words.back(), attached ? std::optional(words[1]) : std::nullopt};
}

/// Asks for SIGTERM at the parent's end; false when that has come already.
bool endWith(const std::string& parent) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  return std::to_string(getppid()) == parent;
}

int run(const std::filesystem::path& folder) {
  std::stop_source stop;
  const std::jthread watcher(watchSignals, stop);
  const auto tell = [](const nlohmann::json& event) { std::cout << event.dump() << std::endl; };
  switch (server::train(folder, tell, stop.get_token())) {
    case server::JobEnd::kDone:
      return 0;
    case server::JobEnd::kStopped:
      return 3;
    case server::JobEnd::kDiverged:
      break;
  }
  std::cerr << "shaped-trainer: the loss is no longer a finite number; try a lower options.learning_rate\n";
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  server::useBestBlasKernels();
  server::catchSignals();
  limitLibraryThreads();
  const auto command = parse({argv + 1, argv + argc});
  if (!command) {
    std::cerr << "usage: shaped-trainer [--parent PID] FOLDER\n";
    return 2;
  }
  if (command->parent && !endWith(*command->parent)) return 3;
  try {
    return run(command->folder);
  } catch (const InvalidInput& error) {
    std::cerr << "shaped-trainer: " << error.what() << "\n";
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "shaped-trainer: " << error.what() << "\n";
    return 1;
  }
}
