#include "core/registration/fitting_step.h"

#include <algorithm>
#include <vector>

namespace shaped {
namespace {

/// Holds the state where nothing else does; relative to the diagonal, small enough to leave all other digits alone.
constexpr double kHold = 1e-10;

/// A factorisation costs about nine solves on a body of 13,000 vertices; beyond this many it is the cheaper way.
constexpr int kMostIterations = 8;

Eigen::SparseMatrix<double> systemOf(const Deformation& deformation, const Pulls& pulls,
                                     const Eigen::SparseMatrix<double>& bound) {
  const auto unknowns = bound.rows();
  std::vector<Eigen::Triplet<double>> triplets;
  for (Eigen::Index v = 0; v < pulls.weights.size(); ++v) {
    const auto row = deformation.positionRow(v);
    triplets.emplace_back(row, row, pulls.weights[v]);
  }
  for (const auto& landmark : pulls.landmarks)
    for (const auto& [row, one] : landmark.point.terms)
      for (const auto& [column, other] : landmark.point.terms)
        if (row >= column) triplets.emplace_back(row, column, landmark.weight * one * other);
  Eigen::SparseMatrix<double> pulling(unknowns, unknowns);
  pulling.setFromTriplets(triplets.begin(), triplets.end());
  Eigen::SparseMatrix<double> system = bound + pulling;
  for (Eigen::Index u = 0; u < unknowns; ++u) {
    double& diagonal = system.coeffRef(u, u);
    diagonal += kHold * std::max(diagonal, 1e-300);
  }
  return system;
}

}  // namespace

double Pulls::energy(const Deformation& deformation, const Eigen::MatrixXd& state) const {
  double sum = 0;
  for (Eigen::Index v = 0; v < weights.size(); ++v)
    if (weights[v] > 0) sum += weights[v] * (state.row(deformation.positionRow(v)) - targets.row(v)).squaredNorm();
  for (const auto& landmark : landmarks)
    sum += landmark.weight * (landmark.point.at(state) - landmark.target).squaredNorm();
  return sum;
}

Eigen::MatrixXd Pulls::gradient(const Deformation& deformation, const Eigen::MatrixXd& state) const {
  Eigen::MatrixXd gradient = Eigen::MatrixXd::Zero(state.rows(), 3);
  for (Eigen::Index v = 0; v < weights.size(); ++v) {
    const auto row = deformation.positionRow(v);
    if (weights[v] > 0) gradient.row(row) += 2 * weights[v] * (state.row(row) - targets.row(v));
  }
  for (const auto& landmark : landmarks)
    for (const auto& [row, coefficient] : landmark.point.terms)
      gradient.row(row) += 2 * landmark.weight * coefficient * (landmark.point.at(state) - landmark.target);
  return gradient;
}

FittingSteps::FittingSteps(const Deformation& deformation, double stiffness)
    : deformation_(deformation), stiffness_(stiffness), bound_(stiffness * deformation.bound()) {}

bool FittingSteps::take(const Pulls& pulls, double accuracy, Eigen::MatrixXd& state, const std::stop_token& stop) {
  const Eigen::SparseMatrix<double> matrix = systemOf(deformation_, pulls, bound_);
  // The bound touches the energy in the state, so their gradients agree; the step solves for the difference.
  const Eigen::MatrixXd right =
      -0.5 * (pulls.gradient(deformation_, state) + stiffness_ * deformation_.gradient(state));
  if (stop.stop_requested() || !right.allFinite()) return false;
  Eigen::MatrixXd residual = right, step = Eigen::MatrixXd::Zero(state.rows(), 3);
  if (!factor_ || !converge(matrix, accuracy, residual, step)) {
    factor_.emplace();
    if (!factor_->compute(matrix, stop)) {
      factor_.reset();
      return false;
    }
    step = factor_->solve(right);
  }
  if (!step.allFinite()) return false;
  state += step;
  return true;
}

/// Conjugate gradients, the three columns side by side: residual and step start at the right-hand side and 0. False
/// when kMostIterations were not enough.
bool FittingSteps::converge(const Eigen::SparseMatrix<double>& matrix, double accuracy, Eigen::MatrixXd& residual,
                            Eigen::MatrixXd& step) const {
  const double wanted = accuracy * residual.norm();
  Eigen::MatrixXd direction;
  Eigen::RowVector3d last;
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    const Eigen::MatrixXd preconditioned = factor_->solve(residual);
    const Eigen::RowVector3d product = residual.cwiseProduct(preconditioned).colwise().sum();
    if (iteration == 0)
      direction = preconditioned;
    else
      direction = preconditioned + direction * (product.array() / last.array().max(1e-300)).matrix().asDiagonal();
    const Eigen::MatrixXd image = matrix.selfadjointView<Eigen::Lower>() * direction;
    const Eigen::RowVector3d curvature = direction.cwiseProduct(image).colwise().sum();
    const Eigen::RowVector3d length = product.array() / curvature.array().max(1e-300);
    step += direction * length.asDiagonal();
    residual -= image * length.asDiagonal();
    if (residual.norm() <= wanted) return true;
    last = product;
  }
  return false;
}

}  // namespace shaped
