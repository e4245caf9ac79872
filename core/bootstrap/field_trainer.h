#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include "core/neural/jacobian_field.h"

namespace shaped {

/// A shape of the model and the registration that the field is to make of it, in the rest pose, m.
struct RestPair {
  Vertices source;          ///< V x 3: the model's fit to the scan, X_o, and what regression and smoothing add to it
  Vertices target;          ///< X, V x 3
  Scan scan;                ///< carried to rest (scanAtRest)
  std::size_t example = 0;  ///< which registration of R_DEFORM it is of
};

/// What a field is trained on.
struct FieldTrainingSet {
  int training = 1;  ///< how many fields have been trained by then, this one counted: tells their folders apart
  std::shared_ptr<const FieldReference> reference;  ///< the model's mean
  FieldScaling scaling;                             ///< of the reference
  std::vector<RestPair> pairs;
};

/// Trains a field. The core needs no LibTorch for it: whoever calls says how. What it answers may depend on the set
/// alone. Nothing when the token fired. May keep a checkpoint of its own: after a stop it is asked again with the same
/// set. Throws what ends the bootstrap.
using FieldTrainer =
    std::function<std::optional<JacobianFieldWeights>(const FieldTrainingSet& set, const std::stop_token& stop)>;

}  // namespace shaped
