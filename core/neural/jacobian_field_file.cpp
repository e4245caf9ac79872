#include "core/neural/jacobian_field_file.h"

namespace shaped {
namespace {

std::string layerName(const std::string& net, std::size_t layer) { return net + "." + std::to_string(layer); }

void addNet(const std::string& net, const std::vector<Linear>& layers, TensorWriter& file) {
  for (std::size_t i = 0; i < layers.size(); ++i) {
    file.addMatrix(layerName(net, i) + ".weight", layers[i].weight);
    file.addMatrix(layerName(net, i) + ".bias", layers[i].bias.transpose());
  }
}

std::vector<Linear> readNet(const TensorFile& file, const std::string& net) {
  std::vector<Linear> layers;
  do {
    const auto layer = layerName(net, layers.size());
    const Eigen::MatrixXf weight = file.matrix<float>(layer + ".weight");
    layers.push_back({weight, file.matrix<float>(layer + ".bias", 1, weight.rows()).transpose()});
  } while (file.has(layerName(net, layers.size()) + ".weight"));
  return layers;
}

void addRegression(const std::string& name, const ResidualRegressionWeights& weights, TensorWriter& file) {
  file.addMatrix(name + ".offset_weights", weights.offset_weights);
  file.addMatrix(name + ".state_weights", weights.state_weights);
  file.addMatrix(name + ".mean", weights.mean.transpose());
  file.addMatrix(name + ".modes", weights.modes);
}

ResidualRegressionWeights readRegression(const TensorFile& file, const std::string& name) {
  return {file.matrix<float>(name + ".offset_weights"), file.matrix<float>(name + ".state_weights"),
          file.matrix<float>(name + ".mean", 1).transpose(), file.matrix<float>(name + ".modes")};
}

}  // namespace

void addJacobianField(const std::string& name, const JacobianFieldWeights& weights, TensorWriter& file) {
  const auto& scaling = weights.scaling;
  file.addMatrix(name + ".scaling.centre", scaling.centre);
  file.addMatrix(name + ".scaling.extent", Eigen::Matrix<double, 1, 1>(scaling.extent));
  file.addMatrix(name + ".scaling.signature_mean", scaling.signature_mean);
  file.addMatrix(name + ".scaling.signature_deviation", scaling.signature_deviation);
  file.addMatrix(name + ".offsets", Eigen::Matrix<std::int64_t, 1, 1>(std::int64_t{weights.offsets}));
  addNet(name + ".source_net", weights.source_net, file);
  addNet(name + ".scan_net", weights.scan_net, file);
  addNet(name + ".mlp", weights.mlp, file);
  if (weights.regression) addRegression(name + ".regression", *weights.regression, file);
  if (weights.smoothness)
    file.addMatrix(name + ".smoothness", Eigen::RowVector2d(weights.smoothness->reach, weights.smoothness->noise));
}

JacobianFieldWeights readJacobianField(const TensorFile& file, const std::string& name) {
  JacobianFieldWeights weights;
  weights.scaling.centre = file.matrix<double>(name + ".scaling.centre", 1, 3);
  weights.scaling.extent = file.matrix<double>(name + ".scaling.extent", 1, 1)(0, 0);
  weights.scaling.signature_mean = file.matrix<float>(name + ".scaling.signature_mean", 1, kFieldSignatures);
  weights.scaling.signature_deviation = file.matrix<float>(name + ".scaling.signature_deviation", 1, kFieldSignatures);
  weights.offsets = file.matrix<std::int64_t>(name + ".offsets", 1, 1)(0, 0) != 0;
  weights.source_net = readNet(file, name + ".source_net");
  weights.scan_net = readNet(file, name + ".scan_net");
  weights.mlp = readNet(file, name + ".mlp");
  if (file.has(name + ".smoothness")) {
    const Eigen::RowVector2d prior = file.matrix<double>(name + ".smoothness", 1, 2);
    weights.smoothness = SmoothPrior{prior[0], prior[1]};
  }
  if (file.has(name + ".regression.mean")) weights.regression = readRegression(file, name + ".regression");
  return weights;
}

}  // namespace shaped
