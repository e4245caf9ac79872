#include "core/statistics/linear_pca.h"

#include <Eigen/Eigenvalues>

#include "core/mesh/alignment.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

using Flat = Eigen::Map<const Eigen::VectorXd>;

Flat flat(const Vertices& shape) { return {shape.data(), shape.size()}; }

/// Aligns all shapes to their running mean until the mean stands still.
std::vector<Vertices> procrustes(const std::vector<Vertices>& shapes, Vertices& mean) {
  std::vector<Vertices> aligned = shapes;
  mean = shapes.front();
  for (int round = 0; round < 100; ++round) {
    Vertices next = Vertices::Zero(mean.rows(), 3);
    for (auto& shape : aligned) {
      shape = apply(alignRigidly(shape, mean), shape);
      next += shape / static_cast<double>(shapes.size());
    }
    const double change = (next - mean).norm() / mean.norm();
    mean = std::move(next);
    if (change < 1e-10) break;
  }
  return aligned;
}

}  // namespace

LinearPca linearPca(const std::vector<Vertices>& shapes) {
  if (shapes.size() < 2) throw InvalidInput("shapes", "linear PCA needs at least two");
  for (std::size_t i = 1; i < shapes.size(); ++i)
    if (shapes[i].rows() != shapes[0].rows())
      throw InvalidInput("shapes[" + std::to_string(i) + "]", "has another vertex count than the first");
  LinearPca pca;
  const auto aligned = procrustes(shapes, pca.mean);
  const auto n = static_cast<Eigen::Index>(shapes.size());
  Eigen::MatrixXd data(pca.mean.size(), n);
  for (Eigen::Index i = 0; i < n; ++i) data.col(i) = flat(aligned[static_cast<std::size_t>(i)]) - flat(pca.mean);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(data.transpose() * data / static_cast<double>(n));
  const Eigen::VectorXd values = eigen.eigenvalues().reverse();
  const Eigen::MatrixXd vectors = eigen.eigenvectors().rowwise().reverse();
  Eigen::Index rank = 0;
  while (rank < n - 1 && values[rank] > 1e-12 * values[0]) ++rank;
  pca.values = values.head(rank);
  pca.modes = data * vectors.leftCols(rank) * (values.head(rank) * static_cast<double>(n)).cwiseSqrt().cwiseInverse().asDiagonal();
  return pca;
}

Vertices projectLinearly(const LinearPca& pca, const Vertices& shape, int modes, Eigen::VectorXd* coefficients) {
  const auto basis = pca.modes.leftCols(std::min<Eigen::Index>(modes, pca.modes.cols()));
  Vertices model = pca.mean;
  Eigen::VectorXd weights;
  for (int round = 0; round < 100; ++round) {
    const Vertices moved = apply(alignRigidly(shape, model), shape);
    weights = basis.transpose() * (flat(moved) - flat(pca.mean));
    const Eigen::VectorXd point = flat(pca.mean) + basis * weights;
    const Vertices next = Eigen::Map<const Vertices>(point.data(), shape.rows(), 3);
    const double change = (next - model).norm();
    model = next;
    if (change < 1e-10 * pca.mean.norm()) break;
  }
  if (coefficients) *coefficients = weights;
  return apply(alignRigidly(model, shape), model);
}

}  // namespace shaped
