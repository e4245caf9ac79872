#pragma once

#include <vector>

#include "core/bootstrap/bootstrap.h"

namespace shaped {

/// The registrations that teach the field, with their scans.
class FieldExamples {
 public:
  /// All must outlive it. Throws InvalidInput naming `examples`, or the registration or scan that is no good.
  FieldExamples(const BootstrapInputs& inputs, const BootstrapOptions& options);

  /// Fits a model to the scan of example i. Nothing once the stop token has fired; a state without numbers where the
  /// fit failed or scores below what is trusted.
  std::optional<BodyState> fit(std::size_t i, const BodyModel& model, const std::stop_token& stop) const;
  /// What the field is to learn of it (bootstrapBody says how the target comes about).
  RestPair pair(std::size_t i, const BodyModel& model, const BodyState& state) const;

 private:
  /// A scan, made ready, and the registration: of a virtual scan where that stands, else as it was given.
  struct Scanned {
    Scan scan;
    Vertices registration;
  };
  Scanned scanned(std::size_t i) const;

  const BootstrapInputs& inputs_;
  const BootstrapOptions& options_;
};

}  // namespace shaped
