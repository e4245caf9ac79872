#pragma once

#include "core/shell/measure_derivatives.h"

namespace shaped {

/// The weighted sum sum_j w_j W[s_j, .] as a function of the deformed shape alone ([HZRS18] (13), (26)).
///
/// Each triangle keeps five numbers and each hinge three, whatever the number of shapes, because W depends on the
/// deformed shape through its squared lengths, areas and angles in a fixed form:
///   sum_i k_i L_i + m A^2 - h log A^2  per triangle,  w (theta* - theta~)^2  per hinge.
/// Angles theta_j are lifted to the sheet nearest to the first shape's, so the sum stays smooth at folds of +-pi.
class AverageEnergy {
 public:
  explicit AverageEnergy(const Topology& topology);

  /// Adds weight W[undeformed, .]; weight >= 0, bending = eta > 0.
  void add(const Topology& topology, const ShellMeasures& undeformed, double bending, double weight);

  double value(const Topology& topology, const ShellMeasures& deformed) const;
  void addGradient(const Topology& topology, const ShellMeasures& deformed, double weight,
                   MeasureGradient& gradient) const;
  void addCurvature(const Topology& topology, const ShellMeasures& deformed, double weight,
                    MeasureCurvature& curvature) const;

 private:
  struct Triangle {
    std::array<double, 3> k{};
    double m = 0, h = 0;
  };
  struct Fold {
    double weight = 0;     ///< sum of w_j c_j
    double target = 0;     ///< theta*, the mean of the lifted angles by these weights
    double reference = 0;  ///< angle of the first shape
  };

  std::vector<Triangle> triangles_;
  std::vector<Fold> folds_;
  double constant_ = 0;  ///< of triangles and of the spread of hinge angles
  bool empty_ = true;
};

}  // namespace shaped
