#include "core/neural/dense_layers.h"

#include "core/numerics/error.h"

namespace shaped {
namespace {

/// What is wrong with a layer after one with `before` outputs (-1: the first); empty when nothing is.
std::string problemOf(const Linear& layer, Eigen::Index before) {
  const auto& [weight, bias] = layer;
  if (weight.size() == 0) return "the weight is empty, want at least 1 x 1";
  if (bias.size() != weight.rows())
    return "the bias has " + std::to_string(bias.size()) + " numbers, want " + std::to_string(weight.rows()) +
           ", as many as the weight has rows";
  if (before >= 0 && weight.cols() != before)
    return "takes " + std::to_string(weight.cols()) + " features, want " + std::to_string(before) +
           ", as the layer before gives";
  if (!weight.allFinite() || !bias.allFinite()) return "holds a number that is not finite";
  return {};
}

}  // namespace

Mlp::Mlp(std::vector<Linear> layers, OutputActivation output, std::string name)
    : layers_(std::move(layers)), output_(output), name_(std::move(name)) {
  if (layers_.empty()) throw InvalidInput(name_ + ".layers", "there is none, want at least one");
  Eigen::Index before = -1;
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    const auto problem = problemOf(layers_[i], before);
    if (!problem.empty()) throw InvalidInput(name_ + ".layers[" + std::to_string(i) + "]", problem);
    before = layers_[i].weight.rows();
  }
}

Eigen::MatrixXf Mlp::operator()(const Eigen::MatrixXf& items) const {
  if (items.cols() != inputs())
    throw InvalidInput(name_,
                       "got " + std::to_string(items.cols()) + " features an item, want " + std::to_string(inputs()));
  Eigen::MatrixXf features = items;
  for (const auto& layer : layers_) {
    Eigen::MatrixXf next = features * layer.weight.transpose();
    next.rowwise() += layer.bias.transpose();
    if (&layer != &layers_.back() || output_ == OutputActivation::kRelu) next = next.cwiseMax(0.0F);
    features = std::move(next);
  }
  return features;
}

PointFeatures PointNet::operator()(const Eigen::MatrixXf& points) const {
  if (points.rows() == 0) throw InvalidInput(shared_.name(), "got no point, want at least one");
  PointFeatures features{shared_(points), {}};
  features.whole = features.each.colwise().maxCoeff();
  return features;
}

}  // namespace shaped
