#include "core/training/field_network.h"

#include "core/training/tensors.h"

namespace shaped {
namespace {

torch::Tensor weightOf(const torch::Tensor& parameters, std::int64_t at, std::int64_t outputs, std::int64_t inputs) {
  return parameters.narrow(0, at, outputs * inputs).view({outputs, inputs});
}

torch::Tensor largest(const torch::Tensor& features) { return std::get<0>(features.max(0)); }

}  // namespace

FieldTensors tensorsOf(const JacobianFieldFeatures& features, torch::Dtype type) {
  const Eigen::Map<const Eigen::VectorX<std::int32_t>> nearest(features.nearest.data(), std::ssize(features.nearest));
  return {tensorOf(features.triangles, type), tensorOf(features.current), tensorOf(features.scan, type),
          tensorOf(nearest, torch::kInt64).view(-1), tensorOf(features.offsets, type)};
}

FieldNetwork::FieldNetwork(const JacobianFieldWeights& weights)
    : local_inputs_(JacobianField(weights).weights().localInputs()), offsets_(weights.offsets) {
  std::int64_t at = 0;
  source_net_ = netOf(weights.source_net, at);
  scan_net_ = netOf(weights.scan_net, at);
  mlp_ = netOf(weights.mlp, at);
}

FieldNetwork::Net FieldNetwork::netOf(const std::vector<Linear>& layers, std::int64_t& at) {
  Net net;
  for (const auto& layer : layers) {
    net.push_back({at, layer.weight.rows(), layer.weight.cols()});
    at += layer.weight.size() + layer.bias.size();
  }
  return net;
}

/// Layers from `first` on, a ReLU before each but the network's first.
torch::Tensor FieldNetwork::apply(const Net& net, std::size_t first, torch::Tensor items,
                                  const torch::Tensor& parameters) {
  for (std::size_t i = first; i < net.size(); ++i) {
    const auto& [at, outputs, inputs] = net[i];
    if (i > 0) items = items.relu();
    items = torch::addmm(parameters.narrow(0, at + outputs * inputs, outputs), items,
                         weightOf(parameters, at, outputs, inputs).t());
  }
  return items;
}

torch::Tensor FieldNetwork::operator()(const torch::Tensor& parameters, const FieldTensors& features) const {
  const auto source = apply(source_net_, 0, features.triangles, parameters).relu();
  const auto scan = apply(scan_net_, 0, features.scan, parameters).relu();
  std::vector<torch::Tensor> items = {features.triangles, features.current.to(parameters.scalar_type()), source,
                                      scan.index_select(0, features.nearest)};
  if (offsets_) items.push_back(features.offsets);
  const auto whole = torch::cat({largest(source), largest(scan)});
  const auto& [at, outputs, inputs] = mlp_.front();
  const auto weight = weightOf(parameters, at, outputs, inputs);
  // What all triangles share is multiplied once.
  const auto bias = parameters.narrow(0, at + outputs * inputs, outputs) +
                    torch::mv(weight.narrow(1, local_inputs_, inputs - local_inputs_), whole);
  const auto hidden = torch::addmm(bias, torch::cat(items, 1), weight.narrow(1, 0, local_inputs_).t());
  return features.current + apply(mlp_, 1, hidden, parameters).to(torch::kFloat64);
}

}  // namespace shaped
