#pragma once

#include <torch/types.h>

#include "core/training/field_network.h"
#include "core/training/field_training.h"

namespace shaped {

/// A training pair as tensors.
struct FieldPairTensors {
  FieldTensors features;
  std::shared_ptr<const JacobianPoisson> poisson;
  Vertices centroids;                        ///< C x 3 of the source's components
  torch::Tensor target;                      ///< V x 3, F64: components moved to where the source's are centred
  torch::Tensor jacobians;                   ///< F x 9, F64, of the target
  torch::Tensor vertex_shares, face_shares;  ///< V and F, F64: parts of the reference's area, each summing to 1
};

FieldPairTensors tensorsOf(const FieldPair& pair, torch::Dtype type);

/// The terms of the loss, before they are weighted; scalars, F64.
struct FieldLossTensors {
  torch::Tensor vertex, jacobian;
};

/// Of a field's Jacobians for that pair, F x 9, F64; see FieldLoss for the formulas.
FieldLossTensors fieldLoss(const torch::Tensor& jacobians, const FieldPairTensors& pair);

}  // namespace shaped
