#pragma once

#include <optional>

#include "core/numerics/newton.h"
#include "core/shell/average_energy.h"
#include "core/shell/energy.h"

namespace shaped {

/// One free shape in a sum of shell energies,
///   E(x) = sum_j w_j W[s_j, x] + sum_k v_k W[x, t_k] + u sum_i |x_i - p_i|^2,
/// for Newton's method. Rigid motions are removed by pinning six unknowns, or by the pins given; where points are
/// pulled (u > 0), nothing needs to be.
///
/// The residual's reference norm is the sum over the terms of the norm of each one's force, the size of the forces that
/// balance at the minimum: measured at the first iterate, and again near the minimum in case the start was far off.
class ShellObjective : public NewtonObjective {
 public:
  ShellObjective(ShellStructurePtr structure, double bending);

  /// Adds weight W[undeformed, x]; weight >= 0.
  void addUndeformed(const ShellMeasures& undeformed, double weight);
  /// Adds weight W[x, deformed]; weight >= 0.
  void addDeformed(ShellMeasures deformed, double weight);
  /// Pulls the vertices towards these points, V x 3; weight >= 0. Once.
  void setPull(Vertices points, double weight);
  /// Holds these unknowns instead of the gauge's; they must determine the rigid motion.
  void setPins(Pins pins) { fixed_pins_ = std::move(pins); }
  /// A reference norm known beforehand, which spares its evaluation.
  void setReferenceNorm(double norm) {
    reference_norm_ = norm;
    reference_given_ = true;
  }

  double value(const Eigen::VectorXd& x) override;
  double noise() const override { return noise_; }
  double gradient(const Eigen::VectorXd& x, Eigen::VectorXd& gradient) override;
  void hessian(const Eigen::VectorXd& x, bool projected, SymmetricBlockMatrix& hessian) override;
  Pins pins(const Eigen::VectorXd& x) override;

 private:
  struct Term {
    ShellMeasures measures;
    double weight;
  };
  void update(const Eigen::VectorXd& x);
  double measureReferenceNorm() const;

  ShellStructurePtr structure_;
  double bending_;
  AverageEnergy average_;
  std::vector<Term> undeformed_, deformed_;
  Vertices pull_points_;
  double pull_ = 0;
  std::optional<Pins> fixed_pins_;
  std::optional<double> reference_norm_;
  bool reference_given_ = false;
  double noise_ = 0;
  Vertices shape_;
  ShellMeasures measures_;
};

/// The flat vector of a shape's coordinates and back.
inline Eigen::VectorXd flatten(const Vertices& shape) {
  return Eigen::Map<const Eigen::VectorXd>(shape.data(), shape.size());
}
inline Vertices unflatten(const Eigen::VectorXd& x) { return Eigen::Map<const Vertices>(x.data(), x.size() / 3, 3); }

/// Minimises the objective from `start`, V x 3.
Solved<Vertices> minimiseShell(ShellObjective& objective, const ShellStructure& structure, const Vertices& start,
                               const NewtonOptions& options);

/// Reference forces are never taken smaller than this, so that equal shapes, whose forces are rounding alone, count as
/// balanced: 1e8 times the force that rounding leaves at equilibrium [m]. Positions carry 16 digits of their distance
/// from the origin, stiff thin triangles turn the rest into forces, and their areas lose digits.
/// At most the force of a strain of 1e-2, so that one nearly collapsed triangle does not hide the others' imbalance.
double forceFloor(const Topology& topology, const Vertices& shape, const ShellMeasures& measures, double bending);

}  // namespace shaped
