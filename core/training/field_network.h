#pragma once

#include <torch/types.h>

#include <vector>

#include "core/neural/jacobian_field.h"

namespace shaped {

/// A field's features as tensors: those that go into networks in one type, the Jacobians in double precision.
struct FieldTensors {
  torch::Tensor triangles;  ///< F x 56
  torch::Tensor current;    ///< F x 9, F64
  torch::Tensor scan;       ///< P x 6
  torch::Tensor nearest;    ///< F, I64
  torch::Tensor offsets;    ///< F x 15
};

FieldTensors tensorsOf(const JacobianFieldFeatures& features, torch::Dtype type);

/// The function that JacobianField evaluates, in LibTorch and differentiable: of the parameters, all in one tensor, and
/// of the features.
class FieldNetwork {
 public:
  /// The sizes are those of the weights. Throws as JacobianField does when they do not fit together.
  explicit FieldNetwork(const JacobianFieldWeights& weights);

  /// parameters: as parametersOf() lays them out, of the features' type. F x 9, F64: the current Jacobians and the
  /// perceptron's output.
  torch::Tensor operator()(const torch::Tensor& parameters, const FieldTensors& features) const;

 private:
  struct Layer {
    std::int64_t at, outputs, inputs;  ///< of the weight, which the bias follows
  };
  using Net = std::vector<Layer>;

  static Net netOf(const std::vector<Linear>& layers, std::int64_t& at);
  static torch::Tensor apply(const Net& net, std::size_t first, torch::Tensor items, const torch::Tensor& parameters);

  Net source_net_, scan_net_, mlp_;
  std::int64_t local_inputs_;
  bool offsets_;
};

}  // namespace shaped
