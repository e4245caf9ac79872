#include "core/shell/shell_objective.h"

#include <algorithm>
#include <cmath>

namespace shaped {

ShellObjective::ShellObjective(ShellStructurePtr structure, double bending)
    : structure_(std::move(structure)), bending_(bending), average_(structure_->topology()) {}

void ShellObjective::addUndeformed(const ShellMeasures& undeformed, double weight) {
  average_.add(structure_->topology(), undeformed, bending_, weight);
  noise_ += 1e-14 * weight * undeformed.area.sum();
  if (!reference_norm_) undeformed_.push_back({undeformed, weight});
}

void ShellObjective::addDeformed(ShellMeasures deformed, double weight) {
  noise_ += 1e-14 * weight * deformed.area.sum();
  deformed_.push_back({std::move(deformed), weight});
}

void ShellObjective::setPull(Vertices points, double weight) {
  pull_points_ = std::move(points);
  pull_ = weight;
}

void ShellObjective::update(const Eigen::VectorXd& x) {
  shape_ = unflatten(x);
  measure(structure_->topology(), shape_, measures_);
}

double ShellObjective::value(const Eigen::VectorXd& x) {
  update(x);
  double sum = average_.value(structure_->topology(), measures_);
  for (const auto& term : deformed_)
    sum += term.weight * shellEnergy(structure_->topology(), measures_, term.measures, bending_);
  if (pull_ > 0) sum += pull_ * (shape_ - pull_points_).squaredNorm();
  return sum;
}

double ShellObjective::gradient(const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
  update(x);
  const auto& topology = structure_->topology();
  MeasureGradient measures(topology);
  average_.addGradient(topology, measures_, 1, measures);
  for (const auto& term : deformed_)
    addFirstGradient(topology, measures_, term.measures, bending_, term.weight, measures);
  Vertices result = Vertices::Zero(shape_.rows(), 3);
  pullBackGradient(topology, shape_, measures, result);
  if (pull_ > 0) result += 2 * pull_ * (shape_ - pull_points_);
  gradient = flatten(result);
  if (!reference_norm_)
    reference_norm_ = measureReferenceNorm();
  else if (!reference_given_ && gradient.norm() < 1e-6 * *reference_norm_)
    reference_norm_ = std::min(*reference_norm_, measureReferenceNorm());
  return *reference_norm_;
}

double ShellObjective::measureReferenceNorm() const {
  const auto& topology = structure_->topology();
  double sum = 0, weights = 0;
  const auto add = [&](const MeasureGradient& measures, double weight) {
    Vertices force = Vertices::Zero(shape_.rows(), 3);
    pullBackGradient(topology, shape_, measures, force);
    sum += force.norm();
    weights += weight;
  };
  MeasureGradient measures(topology);
  for (const auto& term : undeformed_) {
    measures.setZero();
    addSecondGradient(topology, term.measures, measures_, bending_, term.weight, measures);
    add(measures, term.weight);
  }
  for (const auto& term : deformed_) {
    measures.setZero();
    addFirstGradient(topology, measures_, term.measures, bending_, term.weight, measures);
    add(measures, term.weight);
  }
  if (pull_ > 0) sum += 2 * pull_ * (shape_ - pull_points_).norm();
  return sum + weights * forceFloor(topology, shape_, measures_, bending_);
}

void ShellObjective::hessian(const Eigen::VectorXd& x, bool projected, SymmetricBlockMatrix& hessian) {
  update(x);
  const auto& topology = structure_->topology();
  MeasureCurvature curvature(topology, projected ? HessianKind::kProjected : HessianKind::kExact);
  average_.addCurvature(topology, measures_, 1, curvature);
  for (const auto& term : deformed_)
    addFirstCurvature(topology, measures_, term.measures, bending_, term.weight, curvature);
  pullBackHessian(*structure_, shape_, curvature, hessian);
  if (pull_ == 0) return;
  for (std::int32_t v = 0; v < topology.vertexCount(); ++v)
    for (const int entry : {0, 4, 8}) hessian.block(hessian.pattern().lowerSlot(v, v))[entry] += 2 * pull_;
}

Pins ShellObjective::pins(const Eigen::VectorXd& x) {
  if (fixed_pins_) return *fixed_pins_;
  return pull_ > 0 ? Pins(structure_->topology().vertexCount()) : gaugePins(unflatten(x));
}

Solved<Vertices> minimiseShell(ShellObjective& objective, const ShellStructure& structure, const Vertices& start,
                               const NewtonOptions& options) {
  auto solved = minimise(objective, structure.analysis(), flatten(start), options);
  return {unflatten(solved.solution), solved};
}

double forceFloor(const Topology& topology, const Vertices& shape, const ShellMeasures& measures, double bending) {
  constexpr double rounding = 1e-15;
  const double reach = shape.cwiseAbs().maxCoeff();
  double sum = 0;
  for (std::size_t f = 0; f < topology.faceEdges().size(); ++f) {
    double longest = 0;  // squared
    for (const auto edge : topology.faceEdges()[f]) longest = std::max(longest, measures.squared_length[edge]);
    const double slimness = longest / measures.area[static_cast<Eigen::Index>(f)];
    const double noise = 0.5 * reach * slimness + 0.05 * std::sqrt(longest) * slimness * slimness;
    sum += noise * noise;
  }
  for (const auto& hinge : topology.hinges()) {
    const double squared = measures.squared_length[hinge.edges[0]];
    const double one = measures.area[hinge.faces[0]], two = measures.area[hinge.faces[1]];
    // |e|^2 / S times the squared slopes of the angle, 1 / height^2 on either side
    const double noise = bending * reach * squared / (one + two) * squared / 4 * (1 / (one * one) + 1 / (two * two));
    sum += noise * noise;
  }
  return std::min(1e8 * rounding * std::sqrt(sum), 1e-2 * std::sqrt(measures.area.sum()));
}

}  // namespace shaped
