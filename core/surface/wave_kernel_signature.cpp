#include "core/surface/wave_kernel_signature.h"

#include <cmath>

#include "core/numerics/error.h"

namespace shaped {
namespace {

/// Below this share of 1 / area an eigenvalue is a rounded zero; the lowest proper ones of a round surface are near 25.
constexpr double kZero = 1e-8;

/// How many of the ascending eigenvalues are positive.
Eigen::Index positiveCount(const SurfaceSpectrum& spectrum) {
  return (spectrum.eigenvalues.array() > kZero / spectrum.areas.sum()).count();
}

/// Share of each eigenpair in each energy: K x N, columns summing to 1.
Eigen::MatrixXd windows(const Eigen::VectorXd& logarithms, const WaveKernelOptions& options) {
  const double low = logarithms[0], range = logarithms[logarithms.size() - 1] - low;
  const double distance = range / (options.energies - 1), deviation = options.width * distance;
  Eigen::MatrixXd weights(logarithms.size(), options.energies);
  for (int n = 0; n < options.energies; ++n) {
    const Eigen::ArrayXd offset = (low + n * distance - logarithms.array()) / deviation;
    weights.col(n) =
        (-0.5 * (offset.square() - offset.square().minCoeff())).exp();  // a narrow window keeps its nearest
    weights.col(n) /= weights.col(n).sum();
  }
  return weights;
}

}  // namespace

std::optional<std::string> WaveKernelOptions::firstViolation() const {
  if (energies < 2) return "energies = " + std::to_string(energies) + ", want >= 2";
  if (!(width > 0) || !std::isfinite(width)) return "width = " + std::to_string(width) + ", want > 0";
  return std::nullopt;
}

Eigen::MatrixXd waveKernelSignature(const SurfaceSpectrum& spectrum, const WaveKernelOptions& options) {
  if (const auto violation = options.firstViolation()) throw InvalidInput("options", *violation);
  const auto positive = positiveCount(spectrum);
  const Eigen::VectorXd logarithms = spectrum.eigenvalues.tail(positive).array().log();
  if (positive < 2 || !(logarithms[positive - 1] - logarithms[0] > kZero))
    throw InvalidInput("spectrum", "has " + std::to_string(positive) +
                                       " positive eigenvalues, want two that differ; ask for more eigenpairs");
  return spectrum.areas.sum() * spectrum.eigenfunctions.rightCols(positive).cwiseAbs2() * windows(logarithms, options);
}

}  // namespace shaped
