#include "core/curve/reduced_average.h"

#include "core/shell/energy.h"

namespace shaped {
namespace {

Eigen::Map<Eigen::VectorXd> flat(Vertices& shape) { return {shape.data(), shape.size()}; }

}  // namespace

Vertices FrameSpace::ghost(const Eigen::VectorXd& coordinates) const {
  Vertices shape = shared->origin();
  flat(shape).noalias() += shared->basis() * coordinates.head(shared->dimension());
  if (own.size() > 0) flat(shape) += coordinates.tail<1>()[0] * own;
  return shape;
}

ReducedAverage::ReducedAverage(const FrameSpace& space, const PairEnergy& energy, const std::vector<AverageTerm>& terms,
                               CoordinatePull pull)
    : space_(space),
      topology_(space.shared->structure().topology()),
      bending_(energy.bending()),
      undeformed_(topology_),
      pull_(std::move(pull)),
      gradient_(topology_) {
  for (const auto& term : terms) {
    if (term.weight == 0) continue;
    undeformed_.add(topology_, *term.measures, bending_, term.weight);
    noise_ += 1e-14 * term.weight * term.measures->area.sum();
    if (energy.symmetry() == EnergySymmetry::kSymmetric) deformed_.push_back(term);
  }
}

void ReducedAverage::moveTo(const Eigen::VectorXd& coordinates) {
  shape_ = space_.ghost(coordinates);
  measure(topology_, shape_, measures_);
}

void ReducedAverage::project(const Eigen::Ref<const Eigen::VectorXd>& vector, Eigen::VectorXd& coordinates) const {
  coordinates.resize(space_.dimension());
  coordinates.head(space_.shared->dimension()).noalias() = space_.shared->basis().transpose() * vector;
  if (space_.own.size() > 0) coordinates.tail<1>()[0] = space_.own.dot(vector);
}

double ReducedAverage::operator()(const Eigen::VectorXd& coordinates, Eigen::VectorXd& gradient) {
  moveTo(coordinates);
  double value = undeformed_.value(topology_, measures_);
  gradient_.setZero();
  undeformed_.addGradient(topology_, measures_, 1, gradient_);
  for (const auto& term : deformed_) {
    value += term.weight * shellEnergy(topology_, measures_, *term.measures, bending_);
    addFirstGradient(topology_, measures_, *term.measures, bending_, term.weight, gradient_);
  }
  force_.setZero(shape_.rows(), 3);
  pullBackGradient(topology_, shape_, gradient_, force_);
  project(flat(force_), gradient);
  if (pull_.weight > 0) {
    value += pull_.weight * (coordinates - pull_.target).squaredNorm();
    gradient += 2 * pull_.weight * (coordinates - pull_.target);
  }
  return value;
}

Eigen::MatrixXd ReducedAverage::hessian(const Eigen::VectorXd& coordinates) {
  moveTo(coordinates);
  MeasureCurvature curvature(topology_, HessianKind::kProjected);
  undeformed_.addCurvature(topology_, measures_, 1, curvature);
  for (const auto& term : deformed_)
    addFirstCurvature(topology_, measures_, *term.measures, bending_, term.weight, curvature);
  SymmetricBlockMatrix matrix(space_.shared->structure().pattern());
  pullBackHessian(space_.shared->structure(), shape_, curvature, matrix);
  VectorBundle basis(shape_.size(), space_.dimension());
  basis.leftCols(space_.shared->dimension()) = space_.shared->basis();
  if (space_.own.size() > 0) basis.rightCols<1>() = space_.own;
  Eigen::MatrixXd hessian = basis.transpose() * (matrix * basis);
  hessian.diagonal().array() += 2 * pull_.weight;
  return 0.5 * (hessian + hessian.transpose());
}

}  // namespace shaped
