#pragma once

#include "core/mesh/topology.h"

namespace shaped {

/// The rigid-motion invariants of one shape that the shell energy is a function of.
struct ShellMeasures {
  Eigen::VectorXd squared_length;  ///< per edge, l = |e|^2 [m^2]
  Eigen::VectorXd area;            ///< per face [m^2]
  Eigen::VectorXd angle;           ///< per hinge, theta in (-pi, pi], positive on convex edges [rad]
};

/// shape: V x 3. Degenerate faces give a zero area.
void measure(const Topology& topology, const Vertices& shape, ShellMeasures& result);
ShellMeasures measure(const Topology& topology, const Vertices& shape);

/// a - b brought into [-pi, pi].
inline double angleDifference(double a, double b) {
  constexpr double pi = 3.14159265358979323846;
  double d = a - b;
  if (d > pi) d -= 2 * pi;
  if (d < -pi) d += 2 * pi;
  return d;
}

}  // namespace shaped
