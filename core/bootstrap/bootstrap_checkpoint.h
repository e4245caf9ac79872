#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/body/body_model.h"
#include "core/bootstrap/bootstrap_report.h"
#include "core/neural/jacobian_field.h"

namespace shaped {

/// Where a fitted scan stands.
struct FittedScan {
  BootstrapScan report;
  BodyState state;  ///< of the round's model; empty where it could not be registered
};

/// What a bootstrap has reached: all that is needed to go on from there in another process with the same bits.
/// Registrations of the round under way are kept as identity and pose, out of which the surfaces of those that join are
/// made again; the round's model and its training pairs are made again too.
struct BootstrapCheckpoint {
  std::string training;                ///< fingerprint of inputs and options, in the caller's words
  std::vector<BootstrapRound> rounds;  ///< that have ended
  std::vector<Vertices> joined;        ///< Bootstrapped::joined so far
  int trainings = 0;                   ///< fields that were trained
  /// Fits of the field's scans by the present model, as many as there are examples or none; without numbers where the
  /// fit failed or is doubtful.
  std::vector<std::optional<BodyState>> examples;
  std::optional<JacobianFieldWeights> field;  ///< of the present model, once trained
  std::vector<FittedScan> scans;              ///< done in the round under way, ascending

  /// For people: "round 2, registering, 17 scans done".
  std::string stage() const;
};

/// Is offered the state again and again, after each scan too, and keeps what state() makes of it, or not, as it likes:
/// by the clock, which the core does not have, and at once when the bootstrap is being stopped. May throw, which ends
/// the bootstrap. Called from any thread, one call at a time.
using BootstrapCheckpointSink = std::function<void(const std::function<BootstrapCheckpoint()>& state)>;

/// Writes the file as sealed tensors (core/io/sealed_tensors.h), bit for bit; it appears only when complete. Throws
/// FileError.
void writeBootstrapCheckpoint(const std::filesystem::path& path, const BootstrapCheckpoint& checkpoint);

/// Throws InvalidInput naming the file and what is wrong when it is damaged, of another format, or no checkpoint.
BootstrapCheckpoint readBootstrapCheckpoint(const std::filesystem::path& path);

}  // namespace shaped
