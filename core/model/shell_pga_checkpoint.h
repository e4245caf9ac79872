#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "core/mesh/coarsening.h"
#include "core/statistics/principal_variations.h"

namespace shaped {

/// What a training has reached: all that is needed to go on from there in another process. Only the prolongation, which
/// is learned at the end, is always computed anew.
struct ShellPgaCheckpoint {
  std::string training;  ///< fingerprint of shapes and options: a checkpoint of another training is of no use
  Coarsening coarsening;
  std::optional<Spider> spider;  ///< an iterate of the mean; none: the mean has not begun
  Outcome mean;                  ///< of the mean so far, over all processes
  bool mean_ended = false;       ///< `spider` is the mean and `mean` says how it ended
  VariationsProgress variations; ///< what is done of them, once the mean has ended

  /// For people: "Frechet mean, Newton step 12", "Gram matrix, 7 of 72 rows".
  std::string stage() const;
};

/// For people: how far the principal variations are; empty before the first item.
std::string stageOf(const VariationsProgress& done);
/// The items that are done over all there are, 0 to 1.
double shareOf(const VariationsProgress& done);

/// Is offered the state of a training again and again, and keeps what state() makes of it, or not, as it likes: by the
/// clock, which the core does not have, and at once when the training is being stopped. May throw, which ends the
/// training. Called from any thread, one call at a time.
using CheckpointSink = std::function<void(const std::function<ShellPgaCheckpoint()>& state)>;

/// Writes the file; it appears only when complete. Throws FileError.
void writeCheckpoint(const std::filesystem::path& path, const ShellPgaCheckpoint& checkpoint);

/// Throws InvalidInput naming the file and what is wrong when it is damaged, of another format, or no checkpoint.
ShellPgaCheckpoint readCheckpoint(const std::filesystem::path& path);

}  // namespace shaped
