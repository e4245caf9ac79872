#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/neural/jacobian_field.h"

namespace shaped {

/// Sizes of a field's networks.
struct FieldArchitecture {
  std::vector<int> source_net = {64, 64, 64};  ///< outputs of each layer, >= 1
  std::vector<int> scan_net = {64, 64, 64};    ///< outputs of each layer, >= 1
  std::vector<int> mlp = {128, 128, 128};      ///< outputs of each layer but the last, which gives the Jacobian, >= 1
  bool offsets = false;                        ///< JacobianFieldWeights::offsets

  std::optional<std::string> firstViolation() const;  ///< "mlp[1] = 0, want 1 to 4096"
};

/// A field before training: weights drawn from N(0, 2 / inputs) [He et al. 2015], biases 0, and a last layer of zeros,
/// so that it leaves every shape as it is. The same seed gives the same numbers. Throws InvalidInput naming the size.
JacobianFieldWeights untrainedField(const FieldScaling& scaling, const FieldArchitecture& architecture,
                                    std::uint64_t seed);

/// All weights and biases one after another: source_net, scan_net, mlp; of each layer the weight row by row, the bias.
Eigen::VectorXf parametersOf(const JacobianFieldWeights& weights);
/// The other way. parameters: as many as the field has.
void setParameters(const Eigen::VectorXf& parameters, JacobianFieldWeights& weights);

}  // namespace shaped
