#pragma once

#include <string>

#include "core/io/tensor_file.h"
#include "core/neural/jacobian_field.h"

namespace shaped {

/// Tensors of a field under `name`: scaling.centre (1 x 3), scaling.extent (1 x 1), signature_mean and
/// signature_deviation (1 x 50), and source_net, scan_net and mlp as <net>.<layer>.weight (out x in, F32) and .bias
/// (1 x out, F32), layers from 0; offsets (1 x 1, I64, 0 or 1); where it has a
/// regression, regression.offset_weights, state_weights, mean (1 x 3 V) and modes (ResidualRegressionWeights, F32).
void addJacobianField(const std::string& name, const JacobianFieldWeights& weights, TensorWriter& file);

/// The field that was added under that name. Throws InvalidInput naming the file's tensor that is missing or of another
/// shape; whether sizes fit together is for JacobianField to say.
JacobianFieldWeights readJacobianField(const TensorFile& file, const std::string& name);

}  // namespace shaped
