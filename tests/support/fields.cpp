#include "tests/support/fields.h"

namespace shaped::test {
namespace {

Linear zeros(Eigen::Index outputs, Eigen::Index inputs) {
  return {Eigen::MatrixXf::Zero(outputs, inputs), Eigen::VectorXf::Zero(outputs)};
}

/// A single layer of zeros behind networks of two outputs each.
JacobianFieldWeights zeroField(const FieldScaling& scaling, bool offsets) {
  JacobianFieldWeights weights{scaling, {zeros(2, kTriangleInputs)}, {zeros(2, kScanInputs)}, {}, offsets};
  weights.mlp = {zeros(9, weights.localInputs() + 4)};
  return weights;
}

}  // namespace

JacobianFieldWeights constantField(const FieldScaling& scaling, const Eigen::Matrix3d& added) {
  auto weights = zeroField(scaling, false);
  for (Eigen::Index row = 0; row < 3; ++row)
    weights.mlp[0].bias.segment<3>(3 * row) = added.row(row).transpose().cast<float>();
  return weights;
}

JacobianFieldWeights pullField(const FieldScaling& scaling, double gain) {
  auto weights = zeroField(scaling, true);
  const auto begin = weights.localInputs() - 9;
  weights.mlp[0].weight.middleCols<9>(begin) = static_cast<float>(gain) * Eigen::MatrixXf::Identity(9, 9);
  return weights;
}

std::optional<JacobianFieldWeights> trainPullField(const FieldTrainingSet& set, const std::stop_token& stop) {
  if (stop.stop_requested()) return std::nullopt;
  const auto& poisson = *set.reference->poisson;
  double product = 0, square = 0;
  for (const auto& pair : set.pairs) {
    const auto features = jacobianFieldFeatures(*set.reference, pair.source, pair.scan, set.scaling);
    const Eigen::MatrixXd pull = features.offsets.rightCols<9>().cast<double>();
    const Eigen::MatrixXd wanted = poisson.jacobians(pair.target) - features.current;
    product += poisson.areas().dot(wanted.cwiseProduct(pull).rowwise().sum());
    square += poisson.areas().dot(pull.rowwise().squaredNorm());
  }
  return pullField(set.scaling, product / square);
}

}  // namespace shaped::test
