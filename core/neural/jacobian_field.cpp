#include "core/neural/jacobian_field.h"

#include <string>
#include <utility>

#include "core/numerics/error.h"

namespace shaped {
namespace {

std::string countOf(Eigen::Index count, const char* what) { return std::to_string(count) + " " + what; }

void requireInputs(const PointNet& net, Eigen::Index inputs) {
  if (net.inputs() != inputs)
    throw InvalidInput(net.shared().name(),
                       "takes " + countOf(net.inputs(), "features") + ", want " + std::to_string(inputs));
}

void requireFit(const JacobianFieldFeatures& features) {
  const auto faces = features.current.rows();
  if (features.offsets.cols() != kOffsetInputs)
    throw InvalidInput("features", "have offsets of " + countOf(features.offsets.cols(), "numbers, want ") +
                                       std::to_string(kOffsetInputs));
  if (features.triangles.rows() != faces || std::ssize(features.nearest) != faces || features.offsets.rows() != faces)
    throw InvalidInput("features", "have " + countOf(features.triangles.rows(), "triangles, ") +
                                       countOf(std::ssize(features.nearest), "nearest points and ") +
                                       countOf(features.offsets.rows(), "offsets, want ") + std::to_string(faces));
  for (const auto point : features.nearest)
    if (point < 0 || point >= features.scan.rows())
      throw InvalidInput("features",
                         "name scan point " + std::to_string(point) + " of " + std::to_string(features.scan.rows()));
}

/// The first layer for triangles that all share the last inputs: those go into its bias.
Linear withSharedInputs(const Linear& layer, const Eigen::VectorXf& shared) {
  const auto local = layer.weight.cols() - shared.size();
  return {layer.weight.leftCols(local), layer.bias + layer.weight.rightCols(shared.size()) * shared};
}

}  // namespace

Eigen::Index JacobianFieldWeights::localInputs() const {
  return kTriangleInputs + 9 + source_net.back().weight.rows() + scan_net.back().weight.rows() +
         (offsets ? kOffsetInputs : 0);
}

bool isSilent(const JacobianFieldWeights& weights) {
  const auto& last = weights.mlp.back();
  return last.weight.isZero(0) && last.bias.isZero(0);
}

JacobianField::JacobianField(JacobianFieldWeights weights)
    : weights_(std::move(weights)),
      source_net_(weights_.source_net, "source_net"),
      scan_net_(weights_.scan_net, "scan_net") {
  requireScaling(weights_.scaling);
  if (weights_.smoothness) require(*weights_.smoothness);
  requireInputs(source_net_, kTriangleInputs);
  requireInputs(scan_net_, kScanInputs);
  const Mlp mlp(weights_.mlp);
  const auto inputs = weights_.localInputs() + source_net_.outputs() + scan_net_.outputs();
  if (mlp.inputs() != inputs || mlp.outputs() != 9)
    throw InvalidInput("mlp", "takes " + countOf(mlp.inputs(), "features to ") +
                                  countOf(mlp.outputs(), "numbers, want ") + countOf(inputs, "to 9"));
}

Jacobians JacobianField::predict(const JacobianFieldFeatures& features) const {
  requireFit(features);
  const auto source = source_net_(features.triangles), scan = scan_net_(features.scan);
  Eigen::MatrixXf items(features.current.rows(), weights_.localInputs());
  items << features.triangles, features.current.cast<float>(), source.each, scan.each(features.nearest, Eigen::all),
      features.offsets.leftCols(weights_.offsets ? kOffsetInputs : 0);
  Eigen::VectorXf whole(source.whole.size() + scan.whole.size());
  whole << source.whole.transpose(), scan.whole.transpose();
  auto layers = weights_.mlp;
  layers.front() = withSharedInputs(layers.front(), whole);
  return features.current + Mlp(std::move(layers))(items).cast<double>();
}

Vertices JacobianField::deform(const JacobianPoisson& poisson, const JacobianFieldFeatures& features) const {
  return poisson.solve(predict(features), features.centroids);
}

}  // namespace shaped
