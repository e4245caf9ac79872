#pragma once

#include <filesystem>
#include <functional>

#include "core/bootstrap/field_trainer.h"
#include "server/field_training/field_job.h"

namespace shaped::server {

/// Where a training of a field stands.
struct FieldProgress {
  int epoch = 0;  ///< done, from 0
  int epochs = 0;
  double loss = 0;  ///< of that epoch, mean over the pairs; 0 before the first
};

/// How fields are trained: by the program shaped-trainer, which alone has LibTorch.
struct TrainerProcess {
  std::filesystem::path program;
  std::filesystem::path folder;  ///< of the job: each training has one in it, field-<number>, the one before goes
  FieldJobOptions options;
  FieldJobRun run;
  std::function<void(const FieldProgress&)> progress;
  std::function<void(const std::string&)> log;  ///< what an operator may want to know
};

/// Where shaped-trainer is looked for when nobody says: beside this program.
std::filesystem::path defaultTrainer();

/// Throws WrongState, saying what to do, unless there is such a program.
void requireTrainer(const std::filesystem::path& program);

/// Trains by starting the program for each field. Asked to stop it keeps a checkpoint, from which the same training
/// goes on; so it does when something killed the program, a few times. When this process dies, the program keeps a
/// checkpoint and ends. A checkpoint of another training (by another version, say) is removed, which the log hears.
///
/// The trainer throws WrongState when the program is not there or the training diverged, FileError when the disk is
/// full, Corrupted for a result that cannot be read, and std::runtime_error with the program's own words otherwise.
FieldTrainer fieldTrainer(TrainerProcess process);

}  // namespace shaped::server
