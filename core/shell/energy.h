#pragma once

#include "core/shell/measure_derivatives.h"

namespace shaped {

/// Shell energy of deforming one shape into another, [HZRS18] (8) without the common thickness factor:
///   W[s, s~] = sum_t a_t W(G_t) + eta sum_e (theta_e - theta~_e)^2 |e|^2 / (a_t + a_t')   [m^2]
/// with mu = lambda = 1 and all weights from the undeformed shape s; boundary edges have no bending term. Invariant
/// under rigid motions of either argument. eta is the bending weight [m^2], > 0.
///
/// Infinite when a triangle of either shape has no area: the barrier that line searches rely on.
double shellEnergy(const Topology& topology, const ShellMeasures& undeformed, const ShellMeasures& deformed,
                   double bending);
double shellEnergy(const Topology& topology, const Vertices& undeformed, const Vertices& deformed, double bending);

/// The two parts of the energy; bending without its factor eta.
struct ShellEnergyParts {
  double membrane = 0;
  double bending_over_eta = 0;
};
ShellEnergyParts shellEnergyParts(const Topology& topology, const ShellMeasures& undeformed,
                                  const ShellMeasures& deformed);

/// gradient += weight W,1: derivative in the undeformed shape's measures.
void addFirstGradient(const Topology& topology, const ShellMeasures& undeformed, const ShellMeasures& deformed,
                      double bending, double weight, MeasureGradient& gradient);
/// gradient += weight W,2: derivative in the deformed shape's measures.
void addSecondGradient(const Topology& topology, const ShellMeasures& undeformed, const ShellMeasures& deformed,
                       double bending, double weight, MeasureGradient& gradient);

/// curvature += weight W,11, to be pulled back at the undeformed shape.
void addFirstCurvature(const Topology& topology, const ShellMeasures& undeformed, const ShellMeasures& deformed,
                       double bending, double weight, MeasureCurvature& curvature);
/// curvature += weight W,22, to be pulled back at the deformed shape.
void addSecondCurvature(const Topology& topology, const ShellMeasures& undeformed, const ShellMeasures& deformed,
                        double bending, double weight, MeasureCurvature& curvature);

/// matrix += weight W,12: rows are the undeformed shape's unknowns, columns the deformed one's.
void addMixedHessian(const ShellStructure& structure, const Vertices& undeformed,
                     const ShellMeasures& undeformed_measures, const Vertices& deformed,
                     const ShellMeasures& deformed_measures, double bending, double weight, GeneralBlockMatrix& matrix);

/// eta when the user names none [m^2]: 2.5e-5 times the squared diameter, about 1e-4 m^2 for a person. It scales with
/// the square of the size, and a rigid motion of the shape leaves it as it is.
double defaultBending(const Vertices& shape);

}  // namespace shaped
