#pragma once

#include "core/shell/energy.h"

namespace shaped {

/// Which energy stands for the squared distance of two shapes in paths, means and Gram matrices.
enum class EnergySymmetry {
  kDirected,   ///< W[a, b], as [HZRS18] has it: a path and the same path backwards differ by O(1/K)
  kSymmetric,  ///< (W[a, b] + W[b, a]) / 2
};

/// The functional that approximates the squared Riemannian distance, [HZRS18] (6).
///
/// W[a, b] agrees with dist^2 up to a cubic term that changes sign with the direction. It moves the nodes of discrete
/// geodesics by O(1/K) where the symmetric energy, which has no cubic term, moves them by O(1/K^2).
class PairEnergy {
 public:
  /// bending: eta [m^2], > 0. A number alone is the directed energy with that bending weight.
  PairEnergy(double bending, EnergySymmetry symmetry = EnergySymmetry::kDirected)
      : bending_(bending), symmetry_(symmetry) {}

  double bending() const { return bending_; }
  EnergySymmetry symmetry() const { return symmetry_; }

  double value(const Topology& topology, const ShellMeasures& a, const ShellMeasures& b) const;
  /// gradient += weight times the derivative in a's measures, or in b's.
  void addFirstGradient(const Topology& topology, const ShellMeasures& a, const ShellMeasures& b, double weight,
                        MeasureGradient& gradient) const;
  void addSecondGradient(const Topology& topology, const ShellMeasures& a, const ShellMeasures& b, double weight,
                         MeasureGradient& gradient) const;
  /// curvature += weight times the second derivative in a's measures, or in b's.
  void addFirstCurvature(const Topology& topology, const ShellMeasures& a, const ShellMeasures& b, double weight,
                         MeasureCurvature& curvature) const;
  void addSecondCurvature(const Topology& topology, const ShellMeasures& a, const ShellMeasures& b, double weight,
                          MeasureCurvature& curvature) const;
  /// matrix += weight d2/da db: rows are a's unknowns, columns b's.
  void addMixedHessian(const ShellStructure& structure, const Vertices& a, const ShellMeasures& a_measures,
                       const Vertices& b, const ShellMeasures& b_measures, double weight,
                       GeneralBlockMatrix& matrix) const;

 private:
  bool symmetric() const { return symmetry_ == EnergySymmetry::kSymmetric; }
  /// Of each direction.
  double share(double weight) const { return symmetric() ? 0.5 * weight : weight; }

  double bending_;
  EnergySymmetry symmetry_;
};

}  // namespace shaped
