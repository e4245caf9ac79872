#pragma once

#include "core/bootstrap/field_trainer.h"

namespace shaped::test {

/// A field that adds the same 3 x 3 matrix to the Jacobian of every triangle, whatever it sees: networks of zeros and
/// the last layer's bias.
JacobianFieldWeights constantField(const FieldScaling& scaling, const Eigen::Matrix3d& added = Eigen::Matrix3d::Zero());

/// A field that adds `gain` times what pulling each vertex to the scan along its normal changes the Jacobian by, the
/// last nine of JacobianFieldFeatures::offsets: a single layer that hands these inputs on.
JacobianFieldWeights pullField(const FieldScaling& scaling, double gain);

/// Learns that gain by least squares on the set's Jacobians, weighted by area. Needs no LibTorch.
std::optional<JacobianFieldWeights> trainPullField(const FieldTrainingSet& set, const std::stop_token& stop);

}  // namespace shaped::test
