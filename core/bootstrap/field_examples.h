#pragma once

#include <string>
#include <vector>

#include "core/bootstrap/bootstrap.h"

namespace shaped {

/// The registrations that teach a round's field, with their scans: one each where it is given, else
/// BootstrapOptions::virtual_scans of them. First those of R_DEFORM; once registrations are shared, those that the
/// model began with and those that joined, too.
class FieldExamples {
 public:
  /// After that many rounds, in which these joined. All must outlive it. Throws InvalidInput naming `examples`, or the
  /// registration or scan that is no good.
  FieldExamples(const BootstrapInputs& inputs, const BootstrapOptions& options, std::size_t rounds,
                const std::vector<Vertices>& joined);

  /// Scans of all registrations.
  std::size_t count() const { return scans_.size(); }
  /// The registration that scan i is of.
  std::size_t example(std::size_t i) const { return scans_[i]; }

  /// Fits a model to scan i. Nothing once the stop token has fired; a state without numbers where the fit failed or
  /// scores below what is trusted.
  std::optional<BodyState> fit(std::size_t i, const BodyModel& model, const std::stop_token& stop) const;

  /// What the fit of scan i leaves of the registration, which is brought to rest and to where X_o lies. Nothing where
  /// too little of the scan comes to rest.
  std::optional<ResidualExample> residual(std::size_t i, const BodyModel& model, const BodyState& state) const;
  /// What the field is to learn of scan i where the regression predicts `predicted` of that residual. Nothing as above.
  std::optional<RestPair> pair(std::size_t i, const BodyModel& model, const BodyState& state,
                               const ResidualExample& residual, const Vertices& predicted) const;

 private:
  struct Example {
    std::string name;
    const Vertices& registration;
    const std::optional<Scan>& scan;
  };

  void add(std::string name, const Vertices& registration, const std::optional<Scan>& scan);
  Scan scanned(std::size_t i) const;
  Vertices atRest(std::size_t example) const;
  Vertices posed(std::size_t example, std::uint64_t seed) const;

  const BootstrapInputs& inputs_;
  const BootstrapOptions& options_;
  std::vector<Example> examples_;
  std::vector<std::size_t> scans_;  ///< the example of each
};

}  // namespace shaped
