#include "core/training/field_loss.h"

#include "core/surface/laplacian.h"
#include "core/training/poisson_layer.h"
#include "core/training/tensors.h"

namespace shaped {
namespace {

torch::Tensor sharesOf(const Eigen::VectorXd& areas) { return tensorOf(areas / areas.sum()).view(-1); }

torch::Tensor weightedMean(const torch::Tensor& differences, const torch::Tensor& shares) {
  return differences.square().sum(1).dot(shares);
}

}  // namespace

FieldPairTensors tensorsOf(const FieldPair& pair, torch::Dtype type) {
  const auto& poisson = pair.reference->poisson;
  const auto jacobians = poisson->jacobians(pair.target);
  const auto& centroids = pair.features.centroids;
  return {tensorsOf(pair.features, type),
          poisson,
          centroids,
          tensorOf(poisson->solve(jacobians, centroids)),
          tensorOf(jacobians),
          sharesOf(lumpedAreas(pair.reference->shape, poisson->topology().faces())),
          sharesOf(poisson->areas())};
}

FieldLossTensors fieldLoss(const torch::Tensor& jacobians, const FieldPairTensors& pair) {
  const auto shape = poissonSolution(jacobians, pair.poisson, pair.centroids);
  return {weightedMean(shape - pair.target, pair.vertex_shares),
          weightedMean(jacobians - pair.jacobians, pair.face_shares)};
}

}  // namespace shaped
