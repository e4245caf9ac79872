#include "core/shell/average_energy.h"

#include <cmath>
#include <limits>

#include "core/shell/membrane_density.h"

namespace shaped {
namespace {

std::array<double, 3> faceLengths(const Topology& topology, const ShellMeasures& measures, std::size_t f) {
  const auto& e = topology.faceEdges()[f];
  return {measures.squared_length[e[0]], measures.squared_length[e[1]], measures.squared_length[e[2]]};
}

/// The hinge angle brought next to the target.
double foldError(double target, double angle) {
  constexpr double turn = 2 * 3.14159265358979323846;
  return std::remainder(target - angle, turn);
}

}  // namespace

AverageEnergy::AverageEnergy(const Topology& topology)
    : triangles_(static_cast<std::size_t>(topology.faces().rows())), folds_(topology.hinges().size()) {}

void AverageEnergy::add(const Topology& topology, const ShellMeasures& undeformed, double bending, double weight) {
  for (std::size_t f = 0; f < triangles_.size(); ++f) {
    const auto l = faceLengths(topology, undeformed, f);
    const double a = undeformed.area[static_cast<Eigen::Index>(f)];
    for (std::size_t i = 0; i < 3; ++i) triangles_[f].k[i] += weight * MembraneDensity::spread(l, i) / (16 * a);
    triangles_[f].m += weight / (4 * a);
    triangles_[f].h += weight * 0.75 * a;
    constant_ += weight * (1.5 * a * std::log(a) - 1.25 * a);
  }
  const auto& hinges = topology.hinges();
  for (std::size_t h = 0; h < folds_.size(); ++h) {
    auto& fold = folds_[h];
    const double angle = undeformed.angle[static_cast<Eigen::Index>(h)];
    if (empty_) fold.reference = angle;
    const double c = weight * bending * undeformed.squared_length[hinges[h].edges[0]] /
                     (undeformed.area[hinges[h].faces[0]] + undeformed.area[hinges[h].faces[1]]);
    const double offset = foldError(angle, fold.reference);
    // the variance about the running mean grows by this much when a value joins (Welford)
    if (fold.weight + c > 0) {
      const double from_mean = offset - (fold.weight > 0 ? fold.moment / fold.weight : 0);
      constant_ += from_mean * from_mean * c * fold.weight / (fold.weight + c);
    }
    fold.weight += c;
    fold.moment += c * offset;
  }
  empty_ = false;
}

double AverageEnergy::value(const Topology& topology, const ShellMeasures& deformed) const {
  double sum = constant_;
  for (std::size_t f = 0; f < triangles_.size(); ++f) {
    const auto L = faceLengths(topology, deformed, f);
    const auto& t = triangles_[f];
    const double area = deformed.area[static_cast<Eigen::Index>(f)];
    if (!(area > 0)) return std::numeric_limits<double>::infinity();
    sum += t.k[0] * L[0] + t.k[1] * L[1] + t.k[2] * L[2] + t.m * area * area - 2 * t.h * std::log(area);
  }
  for (std::size_t h = 0; h < folds_.size(); ++h) {
    const double d = foldError(folds_[h].target(), deformed.angle[static_cast<Eigen::Index>(h)]);
    sum += folds_[h].weight * d * d;
  }
  return sum;
}

void AverageEnergy::addGradient(const Topology& topology, const ShellMeasures& deformed, double weight,
                                MeasureGradient& gradient) const {
  for (std::size_t f = 0; f < triangles_.size(); ++f) {
    const auto L = faceLengths(topology, deformed, f);
    const auto& t = triangles_[f];
    const double area = deformed.area[static_cast<Eigen::Index>(f)];
    const double slope = t.m - t.h / (area * area);
    for (std::size_t i = 0; i < 3; ++i)
      gradient.edge[topology.faceEdges()[f][i]] += weight * (t.k[i] + slope * MembraneDensity::spread(L, i) / 8);
  }
  for (std::size_t h = 0; h < folds_.size(); ++h) {
    const auto row = static_cast<Eigen::Index>(h);
    gradient.hinge[row] -= 2 * weight * folds_[h].weight * foldError(folds_[h].target(), deformed.angle[row]);
  }
}

void AverageEnergy::addCurvature(const Topology& topology, const ShellMeasures& deformed, double weight,
                                 MeasureCurvature& curvature) const {
  constexpr std::array<std::array<std::size_t, 2>, 6> pairs{{{0, 0}, {1, 1}, {2, 2}, {1, 0}, {2, 1}, {0, 2}}};
  for (std::size_t f = 0; f < triangles_.size(); ++f) {
    const auto L = faceLengths(topology, deformed, f);
    const auto& t = triangles_[f];
    const double squared = deformed.area[static_cast<Eigen::Index>(f)] * deformed.area[static_cast<Eigen::Index>(f)];
    const double slope = t.m - t.h / squared, bow = t.h / (squared * squared) / 64;
    auto& face = curvature.faces[f];
    const std::array<double, 3> s{MembraneDensity::spread(L, 0), MembraneDensity::spread(L, 1), MembraneDensity::spread(L, 2)};
    for (std::size_t p = 0; p < 6; ++p)
      face.length[p] += weight * (slope * (p < 3 ? -0.125 : 0.125) + bow * s[pairs[p][0]] * s[pairs[p][1]]);
    for (std::size_t i = 0; i < 3; ++i) face.weight[i] += weight * (t.k[i] + slope * s[i] / 8);
  }
  for (std::size_t h = 0; h < folds_.size(); ++h) {
    const auto row = static_cast<Eigen::Index>(h);
    curvature.hinges[h].angle_angle += 2 * weight * folds_[h].weight;
    if (curvature.kind == HessianKind::kExact)
      curvature.hinges[h].angle -= 2 * weight * folds_[h].weight * foldError(folds_[h].target(), deformed.angle[row]);
  }
}

}  // namespace shaped
