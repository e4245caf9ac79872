#pragma once

#include <memory>
#include <vector>

#include "core/bootstrap/bootstrap.h"
#include "tests/benchmark/experiments/experiment.h"

namespace shaped::experiments {

/// A scan that a model is measured on.
struct Trial {
  Scan scan;
  Vertices posed, rest;  ///< the truth in the scan's place, and at rest
};

/// A whole number that the environment may name.
int setting(const char* name, int otherwise);

/// Half of `known` for the model, half for the field; the scans are made as they are asked for.
BootstrapInputs growthInputs(const PostureTemplate& reference, const std::vector<Vertices>& known,
                             std::shared_ptr<const std::vector<Scan>> scans);

/// The paper's, over SHAPED_ROUNDS rounds; registrations stand at rest.
BootstrapOptions growthOptions();

/// Tells what template fitting makes of the first model's fits, what the model and its field make of the trials before
/// each round and at the end, then what a model and a field of all registrations at once do.
///
/// SHAPED_KEEP names a folder where the state after each training is kept. A run that finds states there measures them
/// instead of learning anew, which makes minutes of half an hour where single trials are looked into: SHAPED_TRIALS
/// lists them ("1,21"), SHAPED_EACH tells each.
void grow(Report& report, BootstrapInputs inputs, const BootstrapOptions& options, const std::vector<Trial>& trials);

}  // namespace shaped::experiments
