#pragma once

#include <array>
#include <cmath>

namespace shaped {

/// Membrane energy of one triangle, a W(G) with mu = lambda = 1, as a function of six squared lengths ([HZRS18] section
/// 3, density of HRWW12 (8)):
///   f = N / (16 a) + A^2 / (4 a) - (3/4) a log(A^2 / a^2) - (5/4) a,
///   N = sum_i (l_{i+1} + l_{i+2} - l_i) L_i, a and A the areas.
/// Undeformed quantities are l and a, deformed ones L and A; index i is the edge opposite corner i.
struct MembraneDensity {
  std::array<double, 3> l, L;
  double a, A;

  double value() const {
    double n = 0;
    for (std::size_t i = 0; i < 3; ++i) n += spread(l, i) * L[i];
    return n / (16 * a) + A * A / (4 * a) - 1.5 * a * std::log(A / a) - 1.25 * a;
  }

  /// df/dL_i
  double deformedDerivative(std::size_t i) const { return spread(l, i) / (16 * a) + areaSlope() * spread(L, i) / 8; }

  /// df/dl_i
  double undeformedDerivative(std::size_t i) const { return spread(L, i) / (16 * a) + restAreaSlope() * areaDerivative(i); }

  /// d2f/dL_i dL_j
  double deformedSecond(std::size_t i, std::size_t j) const {
    const double squared = A * A;
    return areaSlope() * sign(i, j) / 8 + 0.75 * a / (squared * squared) * spread(L, i) * spread(L, j) / 64;
  }

  /// d2f/dl_i dl_j
  double undeformedSecond(std::size_t i, std::size_t j) const {
    const double a2 = a * a;
    double n = 0;
    for (std::size_t k = 0; k < 3; ++k) n += spread(l, k) * L[k];
    const double curvature = n / (8 * a2 * a) + A * A / (2 * a2 * a) + 1.5 / a;
    return -(spread(L, i) * areaDerivative(j) + spread(L, j) * areaDerivative(i)) / (16 * a2) +
           curvature * areaDerivative(i) * areaDerivative(j) + restAreaSlope() * areaSecond(i, j);
  }

  /// d2f/dl_i dL_j
  double mixed(std::size_t i, std::size_t j) const {
    const double a2 = a * a;
    return sign(i, j) / (16 * a) + (-spread(l, j) / (16 * a2) - spread(L, j) / 8 * (0.25 / a2 + 0.75 / (A * A))) * areaDerivative(i);
  }

  /// da/dl_i
  double areaDerivative(std::size_t i) const { return spread(l, i) / (16 * a); }
  /// d2a/dl_i dl_j
  double areaSecond(std::size_t i, std::size_t j) const {
    return sign(i, j) / (16 * a) - spread(l, i) * spread(l, j) / (256 * a * a * a);
  }

  /// x_{i+1} + x_{i+2} - x_i = 8 d(area^2)/dx_i
  static double spread(const std::array<double, 3>& x, std::size_t i) { return x[(i + 1) % 3] + x[(i + 2) % 3] - x[i]; }

 private:
  static double sign(std::size_t i, std::size_t j) { return i == j ? -1 : 1; }
  /// df/d(A^2)
  double areaSlope() const { return 1 / (4 * a) - 0.75 * a / (A * A); }
  /// df/da at fixed l, L
  double restAreaSlope() const {
    double n = 0;
    for (std::size_t k = 0; k < 3; ++k) n += spread(l, k) * L[k];
    return -n / (16 * a * a) - A * A / (4 * a * a) - 1.5 * std::log(A / a) + 0.25;
  }
};

}  // namespace shaped
