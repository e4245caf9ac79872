#include "core/shell/average_energy.h"

#include <cmath>
#include <limits>

#include "core/shell/area_logs.h"
#include "core/shell/membrane_density.h"

namespace shaped {
namespace {

std::array<double, 3> faceLengths(const Topology& topology, const ShellMeasures& measures, std::size_t f) {
  const auto& e = topology.faceEdges()[f];
  const double* l = measures.squared_length.data();
  return {l[e[0]], l[e[1]], l[e[2]]};
}

/// An angle brought into [-pi, pi].
double wrapped(double angle) {
  constexpr double turn = 2 * 3.14159265358979323846;
  return angle - turn * std::rint(angle / turn);
}

}  // namespace

AverageEnergy::AverageEnergy(const Topology& topology)
    : triangles_(static_cast<std::size_t>(topology.faces().rows())), folds_(topology.hinges().size()) {}

void AverageEnergy::add(const Topology& topology, const ShellMeasures& undeformed, double bending, double weight) {
  AreaLogs logs(undeformed);
  for (std::size_t f = 0; f < triangles_.size(); ++f) {
    auto& triangle = triangles_[f];
    const auto s = spreads(faceLengths(topology, undeformed, f));
    const double a = undeformed.area.data()[f];
    for (std::size_t i = 0; i < 3; ++i) triangle.k[i] += weight * s[i] / (16 * a);
    triangle.m += weight / (4 * a);
    triangle.h += weight * 0.75 * a;
    constant_ += weight * a * (1.5 * logs.at(f) - 1.25);
  }
  const auto& hinges = topology.hinges();
  for (std::size_t h = 0; h < folds_.size(); ++h) {
    auto& fold = folds_[h];
    const double angle = undeformed.angle.data()[h];
    if (empty_) fold.reference = fold.target = angle;
    const double c = weight * bending * undeformed.squared_length[hinges[h].edges[0]] /
                     (undeformed.area[hinges[h].faces[0]] + undeformed.area[hinges[h].faces[1]]);
    if (!(fold.weight + c > 0)) continue;
    // a value that joins moves the mean and adds this much to the spread about it (Welford)
    const double from_mean = fold.reference + wrapped(angle - fold.reference) - fold.target;
    const double share = c / (fold.weight + c);
    constant_ += from_mean * from_mean * fold.weight * share;
    fold.target += from_mean * share;
    fold.weight += c;
  }
  empty_ = false;
}

double AverageEnergy::value(const Topology& topology, const ShellMeasures& deformed) const {
  double sum = constant_;
  AreaLogs logs(deformed);
  for (std::size_t f = 0; f < triangles_.size(); ++f) {
    const auto L = faceLengths(topology, deformed, f);
    const auto& t = triangles_[f];
    const double area = deformed.area.data()[f];
    sum += t.k[0] * L[0] + t.k[1] * L[1] + t.k[2] * L[2] + t.m * area * area - 2 * t.h * logs.at(f);
  }
  for (std::size_t h = 0; h < folds_.size(); ++h) {
    const double d = wrapped(folds_[h].target - deformed.angle.data()[h]);
    sum += folds_[h].weight * d * d;
  }
  return std::isnan(sum) ? std::numeric_limits<double>::infinity() : sum;
}

void AverageEnergy::addGradient(const Topology& topology, const ShellMeasures& deformed, double weight,
                                MeasureGradient& gradient) const {
  for (std::size_t f = 0; f < triangles_.size(); ++f) {
    const auto s = spreads(faceLengths(topology, deformed, f));
    const auto& t = triangles_[f];
    const double area = deformed.area.data()[f];
    const double slope = 0.125 * (t.m - t.h / (area * area));
    for (std::size_t i = 0; i < 3; ++i) gradient.edge[topology.faceEdges()[f][i]] += weight * (t.k[i] + slope * s[i]);
  }
  for (std::size_t h = 0; h < folds_.size(); ++h)
    gradient.hinge.data()[h] -= 2 * weight * folds_[h].weight * wrapped(folds_[h].target - deformed.angle.data()[h]);
}

void AverageEnergy::addCurvature(const Topology& topology, const ShellMeasures& deformed, double weight,
                                 MeasureCurvature& curvature) const {
  for (std::size_t f = 0; f < triangles_.size(); ++f) {
    const auto s = spreads(faceLengths(topology, deformed, f));
    const auto& t = triangles_[f];
    const double squared = deformed.area.data()[f] * deformed.area.data()[f];
    const double slope = 0.125 * (t.m - t.h / squared), bow = t.h / (64 * squared * squared);
    auto& face = curvature.faces[f];
    for (std::size_t p = 0; p < 6; ++p)
      face.length[p] += weight * ((p < 3 ? -slope : slope) + bow * s[kSymmetricPairs[p][0]] * s[kSymmetricPairs[p][1]]);
    for (std::size_t i = 0; i < 3; ++i) face.weight[i] += weight * (t.k[i] + slope * s[i]);
  }
  const bool exact = curvature.kind == HessianKind::kExact;
  for (std::size_t h = 0; h < folds_.size(); ++h) {
    auto& hinge = curvature.hinges[h];
    hinge.angle_angle += 2 * weight * folds_[h].weight;
    if (exact) hinge.angle -= 2 * weight * folds_[h].weight * wrapped(folds_[h].target - deformed.angle.data()[h]);
  }
}

}  // namespace shaped
