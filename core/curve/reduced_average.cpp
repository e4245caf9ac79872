#include "core/curve/reduced_average.h"

#include "core/shell/energy.h"

namespace shaped {

ReducedAverage::ReducedAverage(const ShellStructure& structure, const PairEnergy& energy,
                               const std::vector<AverageTerm>& terms, const Vertices& origin,
                               const Eigen::MatrixXd& basis)
    : structure_(structure),
      topology_(structure.topology()),
      origin_(origin),
      basis_(basis),
      bending_(energy.bending()),
      undeformed_(topology_),
      gradient_(topology_) {
  for (const auto& term : terms) {
    if (term.weight == 0) continue;
    undeformed_.add(topology_, *term.measures, bending_, term.weight);
    noise_ += 1e-14 * term.weight * term.measures->area.sum();
    if (energy.symmetry() == EnergySymmetry::kSymmetric) deformed_.push_back(term);
  }
}

void ReducedAverage::moveTo(const Eigen::VectorXd& q) {
  shape_ = origin_;
  Eigen::Map<Eigen::VectorXd>(shape_.data(), shape_.size()).noalias() += basis_ * q;
  measure(topology_, shape_, measures_);
}

double ReducedAverage::operator()(const Eigen::VectorXd& q, Eigen::VectorXd& gradient) {
  moveTo(q);
  double value = undeformed_.value(topology_, measures_);
  gradient_.setZero();
  undeformed_.addGradient(topology_, measures_, 1, gradient_);
  for (const auto& term : deformed_) {
    value += term.weight * shellEnergy(topology_, measures_, *term.measures, bending_);
    addFirstGradient(topology_, measures_, *term.measures, bending_, term.weight, gradient_);
  }
  force_.setZero(shape_.rows(), 3);
  pullBackGradient(topology_, shape_, gradient_, force_);
  gradient.noalias() = basis_.transpose() * Eigen::Map<const Eigen::VectorXd>(force_.data(), force_.size());
  return value;
}

Eigen::MatrixXd ReducedAverage::hessian(const Eigen::VectorXd& q) {
  moveTo(q);
  MeasureCurvature curvature(topology_, HessianKind::kProjected);
  undeformed_.addCurvature(topology_, measures_, 1, curvature);
  for (const auto& term : deformed_)
    addFirstCurvature(topology_, measures_, *term.measures, bending_, term.weight, curvature);
  SymmetricBlockMatrix matrix(structure_.pattern());
  pullBackHessian(structure_, shape_, curvature, matrix);
  Eigen::MatrixXd image = Eigen::MatrixXd::Zero(basis_.rows(), basis_.cols());
  for (Eigen::Index j = 0; j < basis_.cols(); ++j) matrix.multiplyAdd(basis_.col(j).data(), image.col(j).data());
  return basis_.transpose() * image;
}

}  // namespace shaped
