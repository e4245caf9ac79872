#pragma once

#include "core/statistics/frechet_mean.h"

namespace shaped {

/// The approximate Gram matrix (11) of [HZRS18], n x n, symmetric [m^2]: the polar formula on the first nodes of the
/// spider's arms. Runs a parallel loop in the current TBB arena.
Eigen::MatrixXd gramMatrix(const GeodesicCalculus& calculus, const Spider& spider);

/// Eigenvalues, falling, and orthonormal eigenvectors in the columns, each with its largest entry positive.
struct Spectrum {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
Spectrum spectrum(const Eigen::MatrixXd& symmetric);

}  // namespace shaped
