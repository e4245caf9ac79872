#include "core/shell/energy.h"

#include <limits>

#include "core/shell/hinge_geometry.h"
#include "core/shell/membrane_density.h"

namespace shaped {
namespace {

MembraneDensity density(const Topology& topology, const ShellMeasures& undeformed, const ShellMeasures& deformed,
                        std::size_t f) {
  const auto& e = topology.faceEdges()[f];
  const auto& l = undeformed.squared_length;
  const auto& L = deformed.squared_length;
  const auto row = static_cast<Eigen::Index>(f);
  return {{l[e[0]], l[e[1]], l[e[2]]}, {L[e[0]], L[e[1]], L[e[2]]}, undeformed.area[row], deformed.area[row]};
}

/// Bending of one hinge: eta d^2 l / S with d = theta - theta~, l the squared edge length and S the area sum.
struct BendingTerm {
  double eta, d, l, S;

  double factor() const { return eta * l / S; }
  double factorByLength() const { return eta / S; }
  double factorByArea() const { return -eta * l / (S * S); }
};

BendingTerm bendingTerm(const Hinge& hinge, std::size_t h, const ShellMeasures& undeformed,
                        const ShellMeasures& deformed, double eta) {
  const auto row = static_cast<Eigen::Index>(h);
  return {eta, angleDifference(undeformed.angle[row], deformed.angle[row]), undeformed.squared_length[hinge.edges[0]],
          undeformed.area[hinge.faces[0]] + undeformed.area[hinge.faces[1]]};
}

constexpr std::array<std::array<std::size_t, 2>, 6> kPairs{{{0, 0}, {1, 1}, {2, 2}, {1, 0}, {2, 1}, {0, 2}}};

/// How the bending factor's dependence on the area sum enters the triangles of a hinge: slope times d2(area)/dl dl.
void addAreaCurvature(const Topology& topology, const ShellMeasures& undeformed, std::int32_t face, double slope,
                      FaceCurvature& curvature) {
  const auto rest = density(topology, undeformed, undeformed, static_cast<std::size_t>(face));
  for (std::size_t p = 0; p < 6; ++p) curvature.length[p] += slope * rest.areaSecond(kPairs[p][0], kPairs[p][1]);
  for (std::size_t i = 0; i < 3; ++i) curvature.weight[i] += slope * rest.areaDerivative(i);
}

void addFirstHinge(const BendingTerm& term, double weight, HessianKind kind, HingeCurvature& c) {
  const double factor = term.factor(), by_length = term.factorByLength(), by_area = term.factorByArea(), d = term.d;
  c.angle_angle += weight * 2 * factor;
  if (kind == HessianKind::kProjected) {  // 2 r' r'^T for the residual r = sqrt(factor) d
    c.angle_length += weight * d * by_length;
    c.angle_area += weight * d * by_area;
    const double scale = weight * d * d / (2 * factor);
    c.length_length += scale * by_length * by_length;
    c.length_area += scale * by_length * by_area;
    c.area_area += scale * by_area * by_area;
    return;
  }
  c.angle += weight * 2 * factor * d;
  c.angle_length += weight * 2 * d * by_length;
  c.angle_area += weight * 2 * d * by_area;
  c.length += weight * d * d * by_length;
  c.length_area += -weight * d * d * term.eta / (term.S * term.S);
  c.area_area += weight * d * d * 2 * term.eta * term.l / (term.S * term.S * term.S);
}

}  // namespace

ShellEnergyParts shellEnergyParts(const Topology& topology, const ShellMeasures& undeformed,
                                  const ShellMeasures& deformed) {
  ShellEnergyParts parts;
  for (std::size_t f = 0; f < topology.faceEdges().size(); ++f) {
    const auto triangle = density(topology, undeformed, deformed, f);
    if (!(triangle.a > 0) || !(triangle.A > 0)) return {std::numeric_limits<double>::infinity(), 0};
    parts.membrane += triangle.value();
  }
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
  const auto& face_edges = topology.faceEdges();
  // slope of the bending energy in each face's area, shared by its hinges
  Eigen::VectorXd area_slope = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(face_edges.size()));
  const auto& hinges = topology.hinges();
  for (std::size_t h = 0; h < hinges.size(); ++h) {
    const auto term = bendingTerm(hinges[h], h, undeformed, deformed, bending);
    gradient.hinge[static_cast<Eigen::Index>(h)] += weight * 2 * term.factor() * term.d;
    gradient.edge[hinges[h].edges[0]] += weight * term.d * term.d * term.factorByLength();
    for (const auto face : hinges[h].faces) area_slope[face] += term.d * term.d * term.factorByArea();
  }
  for (std::size_t f = 0; f < face_edges.size(); ++f) {
    const auto triangle = density(topology, undeformed, deformed, f);
    const double slope = area_slope[static_cast<Eigen::Index>(f)];
    for (std::size_t i = 0; i < 3; ++i)
      gradient.edge[face_edges[f][i]] +=
          weight * (triangle.undeformedDerivative(i) + slope * triangle.areaDerivative(i));
  }
}

void addSecondGradient(const Topology& topology, const ShellMeasures& undeformed, const ShellMeasures& deformed,
                       double bending, double weight, MeasureGradient& gradient) {
  const auto& face_edges = topology.faceEdges();
  for (std::size_t f = 0; f < face_edges.size(); ++f) {
    const auto triangle = density(topology, undeformed, deformed, f);
    for (std::size_t i = 0; i < 3; ++i) gradient.edge[face_edges[f][i]] += weight * triangle.deformedDerivative(i);
  }
  const auto& hinges = topology.hinges();
  for (std::size_t h = 0; h < hinges.size(); ++h) {
    const auto term = bendingTerm(hinges[h], h, undeformed, deformed, bending);
    gradient.hinge[static_cast<Eigen::Index>(h)] -= weight * 2 * term.factor() * term.d;
  }
}

void addFirstCurvature(const Topology& topology, const ShellMeasures& undeformed, const ShellMeasures& deformed,
                       double bending, double weight, MeasureCurvature& curvature) {
  curvature.first_argument = true;
  for (std::size_t f = 0; f < curvature.faces.size(); ++f) {
    const auto triangle = density(topology, undeformed, deformed, f);
    auto& face = curvature.faces[f];
    for (std::size_t p = 0; p < 6; ++p)
      face.length[p] += weight * triangle.undeformedSecond(kPairs[p][0], kPairs[p][1]);
    for (std::size_t i = 0; i < 3; ++i) face.weight[i] += weight * triangle.undeformedDerivative(i);
  }
  const auto& hinges = topology.hinges();
  for (std::size_t h = 0; h < hinges.size(); ++h) {
    const auto term = bendingTerm(hinges[h], h, undeformed, deformed, bending);
    addFirstHinge(term, weight, curvature.kind, curvature.hinges[h]);
    if (curvature.kind == HessianKind::kProjected) continue;
    for (const auto face : hinges[h].faces)
      addAreaCurvature(topology, undeformed, face, weight * term.d * term.d * term.factorByArea(),
                       curvature.faces[static_cast<std::size_t>(face)]);
  }
}

void addSecondCurvature(const Topology& topology, const ShellMeasures& undeformed, const ShellMeasures& deformed,
                        double bending, double weight, MeasureCurvature& curvature) {
  for (std::size_t f = 0; f < curvature.faces.size(); ++f) {
    const auto triangle = density(topology, undeformed, deformed, f);
    auto& face = curvature.faces[f];
    for (std::size_t p = 0; p < 6; ++p) face.length[p] += weight * triangle.deformedSecond(kPairs[p][0], kPairs[p][1]);
    for (std::size_t i = 0; i < 3; ++i) face.weight[i] += weight * triangle.deformedDerivative(i);
  }
  const auto& hinges = topology.hinges();
  for (std::size_t h = 0; h < hinges.size(); ++h) {
    const auto term = bendingTerm(hinges[h], h, undeformed, deformed, bending);
    curvature.hinges[h].angle_angle += weight * 2 * term.factor();
    if (curvature.kind == HessianKind::kExact) curvature.hinges[h].angle -= weight * 2 * term.factor() * term.d;
  }
}

double defaultBending(const Vertices& shape) {
  return 2.5e-5 * (shape.colwise().maxCoeff() - shape.colwise().minCoeff()).squaredNorm();
}

}  // namespace shaped
