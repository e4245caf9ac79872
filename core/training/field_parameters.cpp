#include "core/training/field_parameters.h"

#include <ATen/CPUGeneratorImpl.h>

#include "core/numerics/error.h"
#include "core/training/tensors.h"

namespace shaped {
namespace {

using RowMatrixXf = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr int kLargestLayer = 4096;

Linear randomLayer(Eigen::Index outputs, Eigen::Index inputs, const at::Generator& random) {
  const auto numbers = torch::randn({outputs, inputs}, random, torch::kFloat64) * std::sqrt(2.0 / double(inputs));
  return {matrixOf<RowMatrixXf>(numbers), Eigen::VectorXf::Zero(outputs)};
}

std::vector<Linear> randomLayers(Eigen::Index inputs, const std::vector<int>& outputs, const at::Generator& random) {
  std::vector<Linear> layers;
  for (const int count : outputs) {
    layers.push_back(randomLayer(count, inputs, random));
    inputs = count;
  }
  return layers;
}

/// Calls visit with each layer in the order of the parameters.
template <class Weights, class Visit>
void forEachLayer(Weights& weights, const Visit& visit) {
  for (auto* net : {&weights.source_net, &weights.scan_net, &weights.mlp})
    for (auto& layer : *net) visit(layer);
}

std::optional<std::string> violationIn(const char* name, const std::vector<int>& sizes) {
  if (sizes.empty()) return std::string(name) + " is empty, want the size of each layer";
  for (std::size_t i = 0; i < sizes.size(); ++i)
    if (sizes[i] < 1 || sizes[i] > kLargestLayer)
      return std::string(name) + "[" + std::to_string(i) + "] = " + std::to_string(sizes[i]) + ", want 1 to " +
             std::to_string(kLargestLayer);
  return std::nullopt;
}

}  // namespace

std::optional<std::string> FieldArchitecture::firstViolation() const {
  if (auto violation = violationIn("source_net", source_net)) return violation;
  if (auto violation = violationIn("scan_net", scan_net)) return violation;
  return violationIn("mlp", mlp);
}

JacobianFieldWeights untrainedField(const FieldScaling& scaling, const FieldArchitecture& architecture,
                                    std::uint64_t seed) {
  if (const auto violation = architecture.firstViolation()) throw InvalidInput("architecture", *violation);
  const auto random = at::detail::createCPUGenerator(seed);
  JacobianFieldWeights weights;
  weights.scaling = scaling;
  weights.offsets = architecture.offsets;
  weights.source_net = randomLayers(kTriangleInputs, architecture.source_net, random);
  weights.scan_net = randomLayers(kScanInputs, architecture.scan_net, random);
  const auto shared = architecture.source_net.back() + architecture.scan_net.back();
  weights.mlp = randomLayers(weights.localInputs() + shared, architecture.mlp, random);
  weights.mlp.push_back({Eigen::MatrixXf::Zero(9, architecture.mlp.back()), Eigen::VectorXf::Zero(9)});
  return weights;
}

Eigen::VectorXf parametersOf(const JacobianFieldWeights& weights) {
  Eigen::Index count = 0;
  forEachLayer(weights, [&](const Linear& layer) { count += layer.weight.size() + layer.bias.size(); });
  Eigen::VectorXf parameters(count);
  float* next = parameters.data();
  forEachLayer(weights, [&](const Linear& layer) {
    Eigen::Map<RowMatrixXf>(next, layer.weight.rows(), layer.weight.cols()) = layer.weight;
    next += layer.weight.size();
    Eigen::Map<Eigen::VectorXf>(next, layer.bias.size()) = layer.bias;
    next += layer.bias.size();
  });
  return parameters;
}

void setParameters(const Eigen::VectorXf& parameters, JacobianFieldWeights& weights) {
  const float* next = parameters.data();
  forEachLayer(weights, [&](Linear& layer) {
    layer.weight = Eigen::Map<const RowMatrixXf>(next, layer.weight.rows(), layer.weight.cols());
    next += layer.weight.size();
    layer.bias = Eigen::Map<const Eigen::VectorXf>(next, layer.bias.size());
    next += layer.bias.size();
  });
}

}  // namespace shaped
