#include "server/field_training/trainer_process.h"

#include <unistd.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "core/io/file_error.h"
#include "core/numerics/error.h"
#include "server/errors/errors.h"
#include "server/errors/status.h"
#include "server/process/run_program.h"

namespace shaped::server {
namespace {

namespace fs = std::filesystem;

constexpr const char *kName = "shaped-trainer", *kFolder = "field-";
constexpr int kDone = 0, kBadJob = 2, kStopped = 3;  // exit codes of shaped-trainer
constexpr int kMostStarts = 3;

std::string withoutEnd(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

/// One training: its folder and what the program has said of it.
class Training {
 public:
  Training(const TrainerProcess& process, const FieldTrainingSet& set, const std::stop_token& stop)
      : process_(process), stop_(stop), folder_(process.folder / (kFolder + std::to_string(set.training))) {
    removeOthers();
    writeFieldJob(folder_, set, process_.options, process_.run);
  }

  std::optional<JacobianFieldWeights> run() {
    for (int start = 1;; ++start) {
      const auto end = runOnce();
      if (end.exit_code == kDone) return readTrainedField(folder_);
      if (stop_.stop_requested()) return std::nullopt;
      if (start == kMostStarts || !mayTryAgain(end)) fail(end);
    }
  }

 private:
  void removeOthers() const {
    for (const auto& entry : fs::directory_iterator(process_.folder))
      if (entry.path().filename().string().starts_with(kFolder) && entry.path() != folder_)
        fs::remove_all(entry.path());
  }

  ProgramEnd runOnce() {
    requireTrainer(process_.program);
    const Program program{.path = process_.program,
                          .arguments = {"--parent", std::to_string(::getpid()), folder_.string()}};
    return runProgram(
        program, [this](const std::string& line) { hear(line); }, stop_);
  }

  /// A line that is no event of ours is left aside: another version may say more.
  void hear(const std::string& line) {
    const auto event = nlohmann::json::parse(line, nullptr, false);
    if (!event.is_object()) return;
    const auto kind = event.value("event", std::string());
    if (kind == "diverged") diverged_ = true;
    if (kind == "start") process_.progress({0, process_.options.epochs, 0});
    if (kind == "epoch")
      process_.progress(
          {event.value("epoch", 0), event.value("epochs", process_.options.epochs), event.value("loss", 0.0)});
  }

  /// Killed, or stopped by somebody else: it goes on from its checkpoint. A checkpoint that is not of this training is
  /// of no use.
  bool mayTryAgain(const ProgramEnd& end) const {
    if (end.signal != 0 || end.exit_code == kStopped) {
      process_.log(std::string(kName) + " was ended by somebody else and is started again: " + how(end));
      return true;
    }
    if (end.exit_code != kBadJob || !fs::exists(fieldCheckpoint(folder_))) return false;
    process_.log("the training of a field begins anew: " + withoutEnd(end.errors));
    fs::remove(fieldCheckpoint(folder_));
    return true;
  }

  static std::string how(const ProgramEnd& end) {
    auto text = end.signal != 0 ? "signal " + std::to_string(end.signal) + " (" + ::strsignal(end.signal) + ")"
                                : "exit code " + std::to_string(end.exit_code);
    if (const auto errors = withoutEnd(end.errors); !errors.empty()) text += ": " + errors;
    return text;
  }

  [[noreturn]] void fail(const ProgramEnd& end) const {
    if (diverged_)
      throw WrongState("the training of the field diverged: ask for a lower learning_rate than " +
                       std::to_string(process_.options.learning_rate));
    if (saysDiskFull(end.errors)) throw FileError(folder_.string(), "the field cannot be trained: " + how(end));
    if (end.signal != 0)
      throw std::runtime_error(std::string(kName) + " was killed " + std::to_string(kMostStarts) + " times by " +
                               how(end) + "; there may be too little memory for it: see the system's log");
    throw std::runtime_error(std::string(kName) + " could not train the field, " + how(end));
  }

  const TrainerProcess& process_;
  const std::stop_token& stop_;
  const fs::path folder_;
  bool diverged_ = false;
};

}  // namespace

fs::path defaultTrainer() { return fs::read_symlink("/proc/self/exe").parent_path() / kName; }

void requireTrainer(const fs::path& program) {
  if (isProgram(program)) return;
  throw WrongState("there is no program " + program.string() +
                   ", which trains the field of a bootstrap: install it (it is a part of its own, built where LibTorch "
                   "is), or tell the daemon where it is with --trainer");
}

FieldTrainer fieldTrainer(TrainerProcess process) {
  return [process = std::move(process)](const FieldTrainingSet& set, const std::stop_token& stop) {
    return Training(process, set, stop).run();
  };
}

}  // namespace shaped::server
