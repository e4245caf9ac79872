#include "core/shell/energy.h"

#include <cmath>
#include <limits>

#include "core/mesh/quality.h"
#include "core/shell/area_logs.h"
#include "core/shell/membrane_density.h"

namespace shaped {
namespace {

std::array<double, 3> faceLengths(const Topology& topology, const ShellMeasures& measures, std::size_t f) {
  const auto& e = topology.faceEdges()[f];
  const double* l = measures.squared_length.data();
  return {l[e[0]], l[e[1]], l[e[2]]};
}

MembraneDensity density(const Topology& topology, const ShellMeasures& undeformed, const ShellMeasures& deformed,
                        std::size_t f) {
  return {faceLengths(topology, undeformed, f), faceLengths(topology, deformed, f), undeformed.area.data()[f],
          deformed.area.data()[f]};
}

/// Bending of one hinge: eta d^2 l / S with d = theta - theta~, l the squared edge length and S the area sum.
struct BendingTerm {
  double eta, d, l;
  double inverse_area;  ///< 1 / S

  double factor() const { return eta * l * inverse_area; }
  double factorByLength() const { return eta * inverse_area; }
  double factorByArea() const { return -eta * l * inverse_area * inverse_area; }
};

BendingTerm bendingTerm(const Hinge& hinge, std::size_t h, const ShellMeasures& undeformed,
                        const ShellMeasures& deformed, double eta) {
  const double* area = undeformed.area.data();
  return {eta, angleDifference(undeformed.angle.data()[h], deformed.angle.data()[h]),
          undeformed.squared_length.data()[hinge.edges[0]], 1 / (area[hinge.faces[0]] + area[hinge.faces[1]])};
}

void addFace(double weight, const std::array<double, 3>& gradient, const Symmetric3& hessian, FaceCurvature& face) {
  for (std::size_t p = 0; p < 6; ++p) face.length[p] += weight * hessian[p];
  for (std::size_t i = 0; i < 3; ++i) face.weight[i] += weight * gradient[i];
}

void addFirstHinge(const BendingTerm& term, double weight, HessianKind kind, HingeCurvature& c) {
  const double factor = term.factor(), by_length = term.factorByLength(), by_area = term.factorByArea();
  const double once = weight * term.d, squared = once * term.d;
  c.angle_angle += 2 * weight * factor;
  if (kind == HessianKind::kProjected) {  // 2 r' r'^T for the residual r = sqrt(factor) d
    const double scale = squared / (2 * factor);
    c.angle_length += once * by_length;
    c.angle_area += once * by_area;
    c.length_length += scale * by_length * by_length;
    c.length_area += scale * by_length * by_area;
    c.area_area += scale * by_area * by_area;
    return;
  }
  c.angle += 2 * once * factor;
  c.length += squared * by_length;
  c.area += squared * by_area;
  c.angle_length += 2 * once * by_length;
  c.angle_area += 2 * once * by_area;
  c.length_area -= squared * by_length * term.inverse_area;
  c.area_area -= 2 * squared * by_area * term.inverse_area;
}

}  // namespace

ShellEnergyParts shellEnergyParts(const Topology& topology, const ShellMeasures& undeformed,
                                  const ShellMeasures& deformed) {
  ShellEnergyParts parts;
  AreaLogs logs(deformed, undeformed);
  for (std::size_t f = 0; f < topology.faceEdges().size(); ++f)
    parts.membrane += density(topology, undeformed, deformed, f).value(logs.at(f));
  // an area of zero on either side makes the sum infinite or NaN
  if (!std::isfinite(parts.membrane)) return {std::numeric_limits<double>::infinity(), 0};
  const auto& hinges = topology.hinges();
  for (std::size_t h = 0; h < hinges.size(); ++h) {
    const auto term = bendingTerm(hinges[h], h, undeformed, deformed, 1);
    parts.bending_over_eta += term.factor() * term.d * term.d;
  }
  return parts;
}

double shellEnergy(const Topology& topology, const ShellMeasures& undeformed, const ShellMeasures& deformed,
                   double bending) {
  const auto parts = shellEnergyParts(topology, undeformed, deformed);
  return parts.membrane + bending * parts.bending_over_eta;
}

double shellEnergy(const Topology& topology, const Vertices& undeformed, const Vertices& deformed, double bending) {
  return shellEnergy(topology, measure(topology, undeformed), measure(topology, deformed), bending);
}

void addFirstGradient(const Topology& topology, const ShellMeasures& undeformed, const ShellMeasures& deformed,
                      double bending, double weight, MeasureGradient& gradient) {
  AreaLogs logs(deformed, undeformed);
  const auto& face_edges = topology.faceEdges();
  for (std::size_t f = 0; f < face_edges.size(); ++f) {
    const auto slopes = density(topology, undeformed, deformed, f).undeformedGradient(logs.at(f));
    for (std::size_t i = 0; i < 3; ++i) gradient.edge[face_edges[f][i]] += weight * slopes[i];
  }
  const auto& hinges = topology.hinges();
  for (std::size_t h = 0; h < hinges.size(); ++h) {
    const auto term = bendingTerm(hinges[h], h, undeformed, deformed, bending);
    const double squared = weight * term.d * term.d, by_area = squared * term.factorByArea();
    gradient.hinge.data()[h] += weight * 2 * term.factor() * term.d;
    gradient.edge[hinges[h].edges[0]] += squared * term.factorByLength();
    for (const auto face : hinges[h].faces) gradient.area[face] += by_area;
  }
}

void addSecondGradient(const Topology& topology, const ShellMeasures& undeformed, const ShellMeasures& deformed,
                       double bending, double weight, MeasureGradient& gradient) {
  const auto& face_edges = topology.faceEdges();
  for (std::size_t f = 0; f < face_edges.size(); ++f) {
    const auto slopes = density(topology, undeformed, deformed, f).deformedGradient();
    for (std::size_t i = 0; i < 3; ++i) gradient.edge[face_edges[f][i]] += weight * slopes[i];
  }
  const auto& hinges = topology.hinges();
  for (std::size_t h = 0; h < hinges.size(); ++h) {
    const auto term = bendingTerm(hinges[h], h, undeformed, deformed, bending);
    gradient.hinge.data()[h] -= weight * 2 * term.factor() * term.d;
  }
}

void addFirstCurvature(const Topology& topology, const ShellMeasures& undeformed, const ShellMeasures& deformed,
                       double bending, double weight, MeasureCurvature& curvature) {
  curvature.first_argument = true;
  AreaLogs logs(deformed, undeformed);
  for (std::size_t f = 0; f < curvature.faces.size(); ++f) {
    const auto triangle = density(topology, undeformed, deformed, f);
    const double log_ratio = logs.at(f);
    addFace(weight, triangle.undeformedGradient(log_ratio), triangle.undeformedHessian(log_ratio), curvature.faces[f]);
  }
  const auto& hinges = topology.hinges();
  for (std::size_t h = 0; h < hinges.size(); ++h)
    addFirstHinge(bendingTerm(hinges[h], h, undeformed, deformed, bending), weight, curvature.kind,
                  curvature.hinges[h]);
}

void addSecondCurvature(const Topology& topology, const ShellMeasures& undeformed, const ShellMeasures& deformed,
                        double bending, double weight, MeasureCurvature& curvature) {
  for (std::size_t f = 0; f < curvature.faces.size(); ++f) {
    const auto triangle = density(topology, undeformed, deformed, f);
    addFace(weight, triangle.deformedGradient(), triangle.deformedHessian(), curvature.faces[f]);
  }
  const auto& hinges = topology.hinges();
  for (std::size_t h = 0; h < hinges.size(); ++h) {
    const auto term = bendingTerm(hinges[h], h, undeformed, deformed, bending);
    curvature.hinges[h].angle_angle += weight * 2 * term.factor();
    if (curvature.kind == HessianKind::kExact) curvature.hinges[h].angle -= weight * 2 * term.factor() * term.d;
  }
}

double defaultBending(const Vertices& shape) {
  const double size = diameter(shape);
  return 2.5e-5 * size * size;
}

}  // namespace shaped
