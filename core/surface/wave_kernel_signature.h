#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "core/surface/spectrum.h"

namespace shaped {

struct WaveKernelOptions {
  int energies = 50;  ///< levels N, >= 2
  double width = 7;   ///< deviation of a level's window, in distances between levels, > 0

  std::optional<std::string> firstViolation() const;  ///< "energies = 1, want >= 2"; empty when all is well
};

/// Wave kernel signature [Aubry, Schlickewei and Cremers 2011]: how likely a quantum particle of about a given energy
/// is met at each vertex. V x N; entry (x, n), over the eigenpairs with lambda_k > 0, the lowest of them lambda_1:
///   area * sum_k phi_k(x)^2 w_n(k) / sum_k w_n(k),  w_n(k) = exp(-(e_n - log lambda_k)^2 / (2 sigma^2)),
/// at energies e_1 = log lambda_1, ..., e_N = log lambda_last in equal distances, sigma = width * distance.
///
/// Without unit: the factor `area` (ours) makes the area-weighted mean over the surface 1 at every energy. Isometries
/// and uniform scaling leave it alone. Functions that share an eigenvalue count through the sum of their squares, so
/// their basis does not matter, unless the spectrum ends between them.
///
/// Throws InvalidInput when an option is out of range, or naming `spectrum` when it has no two different positive
/// eigenvalues.
Eigen::MatrixXd waveKernelSignature(const SurfaceSpectrum& spectrum, const WaveKernelOptions& options = {});

}  // namespace shaped
