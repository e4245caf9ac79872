#include "core/editing/anchored_fit.h"

#include <Eigen/Dense>

#include "core/shell/shell_objective.h"

namespace shaped {
namespace {

class AnchoredObjective : public NewtonObjective {
 public:
  AnchoredObjective(const GeodesicCalculus& calculus, const Vertices& prior, const std::vector<AnchorTarget>& targets,
                    double prior_weight)
      : structure_(*calculus.structure()), faces_(calculus.topology().faces()), targets_(targets),
        shell_(calculus.structure(), calculus.bending()) {
    shell_.addDeformed(measure(calculus.topology(), prior), prior_weight);
  }

  double value(const Eigen::VectorXd& x) override {
    double sum = shell_.value(x);
    const Vertices shape = unflatten(x);
    for (const auto& target : targets_)
      if (target.weight > 0) sum += target.weight * (shaped::position(target.anchor, faces_, shape) - target.position).squaredNorm();
    return sum;
  }

  double noise() const override { return shell_.noise(); }

  double gradient(const Eigen::VectorXd& x, Eigen::VectorXd& gradient) override {
    double reference = shell_.gradient(x, gradient);
    const Vertices shape = unflatten(x);
    for (const auto& target : targets_) {
      if (!(target.weight > 0)) continue;
      const Eigen::Vector3d error = shaped::position(target.anchor, faces_, shape) - target.position;
      const Eigen::Matrix<double, 9, 1> force = 2 * target.weight * positionJacobian(target.anchor, faces_, shape).transpose() * error;
      reference += force.norm();
      for (int c = 0; c < 3; ++c) gradient.segment<3>(3 * faces_(target.anchor.face, c)) += force.segment<3>(3 * c);
    }
    return reference;
  }

  void hessian(const Eigen::VectorXd& x, bool projected, SymmetricBlockMatrix& hessian) override {
    shell_.hessian(x, projected, hessian);
    const Vertices shape = unflatten(x);
    const auto& pattern = hessian.pattern();
    for (const auto& target : targets_) {
      if (!(target.weight > 0)) continue;
      // Gauss-Newton: exact for points on the surface, whose positions are linear
      const Eigen::Matrix<double, 3, 9> jacobian = positionJacobian(target.anchor, faces_, shape);
      const Eigen::Matrix<double, 9, 9> element = 2 * target.weight * jacobian.transpose() * jacobian;
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) {
          const auto row = faces_(target.anchor.face, r), column = faces_(target.anchor.face, c);
          if (row < column) continue;
          Eigen::Map<Eigen::Matrix3d>(hessian.block(pattern.lowerSlot(row, column))) += element.block<3, 3>(3 * r, 3 * c);
        }
    }
  }

  Pins pins(const Eigen::VectorXd&) override { return Pins(structure_.topology().vertexCount()); }

 private:
  const ShellStructure& structure_;
  const Faces& faces_;
  const std::vector<AnchorTarget>& targets_;
  ShellObjective shell_;
};

}  // namespace

Solved<Vertices> fitAnchored(const GeodesicCalculus& calculus, const Vertices& prior,
                             const std::vector<AnchorTarget>& targets, const Vertices& start,
                             const AnchoredFitOptions& options) {
  AnchoredObjective objective(calculus, prior, targets, options.prior_weight);
  auto solved = minimise(objective, calculus.structure()->analysis(), flatten(start),
                         {options.max_iterations, options.tolerance, options.stop});
  return {unflatten(solved.solution), solved};
}

bool determinePlacement(const std::vector<AnchorTarget>& targets) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double count = 0;
  for (const auto& target : targets)
    if (target.weight > 0) mean += target.position, ++count;
  if (count < 3) return false;
  mean /= count;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const auto& target : targets)
    if (target.weight > 0) scatter += (target.position - mean) * (target.position - mean).transpose();
  const Eigen::Vector3d spread = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter, Eigen::EigenvaluesOnly).eigenvalues();
  return spread[1] > 1e-10 * spread[2];
}

Vertices anchorPositions(const Topology& topology, const std::vector<AnchorTarget>& targets, const Vertices& shape) {
  Vertices positions(static_cast<Eigen::Index>(targets.size()), 3);
  for (std::size_t l = 0; l < targets.size(); ++l)
    positions.row(static_cast<Eigen::Index>(l)) = shaped::position(targets[l].anchor, topology.faces(), shape);
  return positions;
}

}  // namespace shaped
