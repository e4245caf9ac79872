#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "core/bootstrap/field_trainer.h"

namespace shaped::server {

/// What shaped-trainer is asked for; what is not here it chooses itself (server/trainer/job_spec.h).
struct FieldJobOptions {
  int epochs = 100;             ///< passes over all pairs, >= 1
  int batch = 4;                ///< pairs a step, >= 1
  double learning_rate = 1e-3;  ///< of Adam, > 0, <= 1; it falls to a hundredth
  bool offsets = true;          ///< whether the field also sees how far the scan is off (JacobianFieldWeights::offsets)
  std::uint64_t seed = 1;

  std::optional<std::string> firstViolation() const;  ///< "epochs = 0, want >= 1"
};

/// How shaped-trainer is to go about it; what is learned does not depend on it.
struct FieldJobRun {
  int threads = 1;                 ///< >= 1
  double checkpoint_seconds = 60;  ///< at least so long between checkpoints, >= 0
};

/// Writes a job folder: job.json, which comes last, the reference and the pairs. What another run has left in it, a
/// checkpoint too, stays. The same set gives the same bytes. Throws FileError.
void writeFieldJob(const std::filesystem::path& folder, const FieldTrainingSet& set, const FieldJobOptions& options,
                   const FieldJobRun& run);

/// The field that shaped-trainer left in the folder. Throws Corrupted.
JacobianFieldWeights readTrainedField(const std::filesystem::path& folder);

/// What shaped-trainer goes on from, if it is there.
std::filesystem::path fieldCheckpoint(const std::filesystem::path& folder);

}  // namespace shaped::server
