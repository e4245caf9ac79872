#pragma once

#include <array>

namespace shaped {

/// Entries of a symmetric 3 x 3 matrix: (0,0) (1,1) (2,2) (1,0) (2,1) (0,2).
using Symmetric3 = std::array<double, 6>;
inline constexpr std::array<std::array<std::size_t, 2>, 6> kSymmetricPairs{
    {{0, 0}, {1, 1}, {2, 2}, {1, 0}, {2, 1}, {0, 2}}};

/// x_{i+1} + x_{i+2} - x_i for a triangle's squared lengths: 8 d(area^2)/dx_i.
inline std::array<double, 3> spreads(const std::array<double, 3>& x) {
  return {x[1] + x[2] - x[0], x[2] + x[0] - x[1], x[0] + x[1] - x[2]};
}

/// Membrane energy of one triangle, a W(G) with mu = lambda = 1, as a function of six squared lengths ([HZRS18] section
/// 3, density of HRWW12 (8)):
///   f = N / (16 a) + A^2 / (4 a) - (3/2) a log(A / a) - (5/4) a,
///   N = sum_i (l_{i+1} + l_{i+2} - l_i) L_i = sum_i (L_{i+1} + L_{i+2} - L_i) l_i.
/// Undeformed quantities are l and a, deformed ones L and A; index i is the edge opposite corner i. Where log(A / a)
/// enters, the caller passes it, because logarithms are cheapest computed many at a time.
class MembraneDensity {
 public:
  MembraneDensity(const std::array<double, 3>& l, const std::array<double, 3>& L, double a, double A)
      : s_(spreads(l)), S_(spreads(L)), n_(s_[0] * L[0] + s_[1] * L[1] + s_[2] * L[2]), a_(a), A_(A) {}

  double value(double log_ratio) const { return (0.0625 * n_ + 0.25 * A_ * A_) / a_ - a_ * (1.5 * log_ratio + 1.25); }

  /// df/dL
  std::array<double, 3> deformedGradient() const {
    const double rest = 0.0625 / a_, slope = 0.125 * areaSlope();
    return {rest * s_[0] + slope * S_[0], rest * s_[1] + slope * S_[1], rest * s_[2] + slope * S_[2]};
  }

  /// df/dl
  std::array<double, 3> undeformedGradient(double log_ratio) const {
    const double rest = 0.0625 / a_, slope = rest * restAreaSlope(log_ratio);
    return {rest * S_[0] + slope * s_[0], rest * S_[1] + slope * s_[1], rest * S_[2] + slope * s_[2]};
  }

  /// d2f/dL dL
  Symmetric3 deformedHessian() const {
    const double slope = 0.125 * areaSlope(), squared = A_ * A_, bow = 0.75 / 64 * a_ / (squared * squared);
    Symmetric3 result;
    for (std::size_t p = 0; p < 6; ++p)
      result[p] = (p < 3 ? -slope : slope) + bow * S_[kSymmetricPairs[p][0]] * S_[kSymmetricPairs[p][1]];
    return result;
  }

  /// d2f/dl dl
  Symmetric3 undeformedHessian(double log_ratio) const {
    const double inverse = 1 / a_, rest = 0.0625 * inverse;  // da/dl_i = rest s_i
    const double curvature = (0.125 * n_ + 0.5 * A_ * A_) * inverse * inverse * inverse + 1.5 * inverse;
    const double slope = restAreaSlope(log_ratio);
    const double both = (curvature - slope * inverse) * rest * rest, mixed = rest * rest * inverse;
    Symmetric3 result;
    for (std::size_t p = 0; p < 6; ++p) {
      const auto [i, j] = kSymmetricPairs[p];
      result[p] = (p < 3 ? -slope : slope) * rest + both * s_[i] * s_[j] - mixed * (S_[i] * s_[j] + S_[j] * s_[i]);
    }
    return result;
  }

  /// d2f/dl_i dL_j, row i
  std::array<std::array<double, 3>, 3> mixedHessian() const {
    const double inverse = 1 / a_, rest = 0.0625 * inverse;
    const double by_area = -0.125 * (0.25 * inverse * inverse + 0.75 / (A_ * A_));
    std::array<std::array<double, 3>, 3> result;
    for (std::size_t j = 0; j < 3; ++j) {
      const double slope = rest * (by_area * S_[j] - rest * inverse * s_[j]);
      for (std::size_t i = 0; i < 3; ++i) result[i][j] = (i == j ? -rest : rest) + slope * s_[i];
    }
    return result;
  }

 private:
  /// df/d(A^2)
  double areaSlope() const { return 0.25 / a_ - 0.75 * a_ / (A_ * A_); }
  /// df/da at fixed l, L
  double restAreaSlope(double log_ratio) const {
    return -(0.0625 * n_ + 0.25 * A_ * A_) / (a_ * a_) - 1.5 * log_ratio + 0.25;
  }

  std::array<double, 3> s_, S_;  ///< spreads of l and L
  double n_, a_, A_;
};

}  // namespace shaped
