#include "core/registration/fitting_step.h"

#include "core/numerics/scalar_cholesky.h"

namespace shaped {
namespace {

/// Holds the state where nothing else does; relative to the diagonal, small enough to leave all other digits alone.
constexpr double kHold = 1e-10;

Eigen::SparseMatrix<double> system(const Deformation& deformation, const Pulls& pulls, double stiffness) {
  const auto unknowns = deformation.bound().rows();
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
  return stiffness * deformation.bound() + pulling;
}

Eigen::MatrixXd rightHandSide(const Deformation& deformation, const Pulls& pulls, double stiffness,
                              const Eigen::MatrixXd& state) {
  Eigen::MatrixXd right = stiffness * deformation.boundRight(state);
  for (Eigen::Index v = 0; v < pulls.weights.size(); ++v)
    if (pulls.weights[v] > 0) right.row(deformation.positionRow(v)) += pulls.weights[v] * pulls.targets.row(v);
  for (const auto& landmark : pulls.landmarks)
    for (const auto& [row, coefficient] : landmark.point.terms)
      right.row(row) += landmark.weight * coefficient * landmark.target;
  return right;
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

bool fittingStep(const Deformation& deformation, const Pulls& pulls, double stiffness, Eigen::MatrixXd& state,
                 const std::stop_token& stop) {
  Eigen::SparseMatrix<double> matrix = system(deformation, pulls, stiffness);
  const Eigen::VectorXd hold = kHold * matrix.diagonal().array().max(1e-300);
  for (Eigen::Index u = 0; u < hold.size(); ++u) matrix.coeffRef(u, u) += hold[u];
  const Eigen::MatrixXd right =
      rightHandSide(deformation, pulls, stiffness, state) + Eigen::MatrixXd(hold.asDiagonal() * state);
  ScalarCholesky factor;
  if (!right.allFinite() || !factor.compute(matrix, stop)) return false;
  const Eigen::MatrixXd solved = factor.solve(right);
  if (!solved.allFinite()) return false;
  state = solved;
  return true;
}

}  // namespace shaped
