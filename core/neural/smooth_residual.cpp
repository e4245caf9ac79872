#include "core/neural/smooth_residual.h"

#include <oneapi/tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "core/numerics/error.h"
#include "core/numerics/option_checks.h"

namespace shaped {
namespace {

constexpr double kExponent = 1.5;
constexpr std::array kReaches{0.05, 0.1, 0.2, 0.4};  ///< of the extent
constexpr std::array kNoises{1e-6, 1e-5, 1e-4, 1e-3, 1e-2};
constexpr Eigen::Index kBlock = 256;  ///< vertices whose equations are made at once: they stay in the cache

/// Variances of the spectrum's coefficients with which displacements have variance 1 on the mean over the surface.
Eigen::VectorXd variancesOf(const SurfaceSpectrum& spectrum, double reach) {
  const Eigen::ArrayXd powers = (1 + reach * reach * spectrum.eigenvalues.array()).pow(-kExponent);
  return powers * (spectrum.areas.sum() / powers.sum());
}

/// Least squares of the offsets: the mean over the surface of (n . u - offset)^2 where one is seen, as
/// c^T A c - 2 b^T c + const, for the coefficients of x, y and z one after the other.
struct NormalEquations {
  Eigen::MatrixXd a;  ///< lower triangle
  Eigen::VectorXd b;

  NormalEquations(const SurfaceSpectrum& spectrum, const Vertices& normals, const Eigen::VectorXd& offsets) {
    const Eigen::Index count = spectrum.eigenvalues.size(), vertices = normals.rows();
    a.setZero(3 * count, 3 * count);
    b.setZero(3 * count);
    const double area = spectrum.areas.sum();
    Eigen::MatrixXd rows(kBlock, 3 * count);
    Eigen::VectorXd values(kBlock);
    Eigen::Index filled = 0;
    const auto add = [&] {
      if (filled == 0) return;
      a.selfadjointView<Eigen::Lower>().rankUpdate(rows.topRows(filled).transpose());
      b.noalias() += rows.topRows(filled).transpose() * values.head(filled);
      filled = 0;
    };
    for (Eigen::Index v = 0; v < vertices; ++v) {
      if (std::isnan(offsets[v])) continue;
      const double weight = std::sqrt(spectrum.areas[v] / area);
      for (int axis = 0; axis < 3; ++axis)
        rows.row(filled).segment(axis * count, count) = weight * normals(v, axis) * spectrum.eigenfunctions.row(v);
      values[filled] = weight * offsets[v];
      if (++filled == kBlock) add();
    }
    add();
  }

  /// The most likely coefficients, 3 k.
  Eigen::VectorXd solve(const SurfaceSpectrum& spectrum, const SmoothPrior& prior) const {
    Eigen::MatrixXd posterior = a;
    const Eigen::VectorXd precisions = prior.noise * variancesOf(spectrum, prior.reach).cwiseInverse();
    posterior.diagonal() += precisions.replicate(3, 1);
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Lower> factor(posterior);
    return factor.solve(b);
  }
};

Vertices displacements(const SurfaceSpectrum& spectrum, const Eigen::VectorXd& coefficients) {
  const Eigen::Index count = spectrum.eigenvalues.size();
  return spectrum.eigenfunctions * Eigen::Map<const Eigen::MatrixXd>(coefficients.data(), count, 3);
}

void requireSizes(const std::string& what, const SurfaceSpectrum& spectrum, const Vertices& normals,
                  const Eigen::VectorXd& offsets) {
  const auto vertices = spectrum.areas.size();
  if (normals.rows() == vertices && normals.allFinite() && offsets.size() == vertices) return;
  throw InvalidInput(what, "has " + std::to_string(normals.rows()) + " normals and " + std::to_string(offsets.size()) +
                               " offsets, want " + std::to_string(vertices) + " finite ones");
}

}  // namespace

void require(const SmoothPrior& prior) {
  for (const auto& [name, value] : {std::pair{"reach", prior.reach}, {"noise", prior.noise}})
    if (const auto problem = unlessPositive(name, value)) throw InvalidInput("prior", *problem);
}

Vertices smoothResidual(const SurfaceSpectrum& spectrum, const SmoothPrior& prior, const Vertices& normals,
                        const Eigen::VectorXd& offsets) {
  require(prior);
  requireSizes("offsets", spectrum, normals, offsets);
  return displacements(spectrum, NormalEquations(spectrum, normals, offsets).solve(spectrum, prior));
}

FittedSmoothness fitSmoothness(const SurfaceSpectrum& spectrum, double extent,
                               const std::vector<SmoothExample>& examples) {
  FittedSmoothness fitted;
  if (examples.empty()) return fitted;
  for (std::size_t i = 0; i < examples.size(); ++i) {
    const auto name = "examples[" + std::to_string(i) + "]";
    requireSizes(name, spectrum, examples[i].normals, examples[i].offsets);
    if (examples[i].residual.rows() != spectrum.areas.size())
      throw InvalidInput(name, "has a residual of another size");
  }
  std::vector<SmoothPrior> priors;
  for (const double reach : kReaches)
    for (const double noise : kNoises) priors.push_back({reach * extent, noise});
  Eigen::MatrixXd left(priors.size(), examples.size());
  tbb::parallel_for(std::size_t{0}, examples.size(), [&](std::size_t i) {
    const auto& example = examples[i];
    const NormalEquations equations(spectrum, example.normals, example.offsets);
    for (std::size_t p = 0; p < priors.size(); ++p)
      left(Eigen::Index(p), Eigen::Index(i)) =
          (example.residual - displacements(spectrum, equations.solve(spectrum, priors[p]))).squaredNorm();
  });
  for (const auto& example : examples) fitted.before += example.residual.squaredNorm();
  Eigen::Index best = 0;
  const double least = left.rowwise().sum().minCoeff(&best);
  if (least < fitted.before) fitted.prior = priors[std::size_t(best)];
  const double values = double(examples.size()) * double(spectrum.areas.size());
  fitted.after = std::sqrt(std::min(least, fitted.before) / values);
  fitted.before = std::sqrt(fitted.before / values);
  return fitted;
}

}  // namespace shaped
