#pragma once

#include "core/statistics/frechet_mean.h"

namespace shaped {

/// The energies that the approximate Gram matrix (11) of [HZRS18] is made of, row by row: rows are independent of each
/// other, so that a long computation can keep those it has.
class GramEnergies {
 public:
  GramEnergies(const GeodesicCalculus& calculus, const Spider& spider);

  /// n energies of row i [m^2]: W[s_1^i, s_1^j] for j != i, and of the mean against s_1^i at j = i.
  Eigen::VectorXd row(std::size_t i) const;
  /// The Gram matrix, n x n, out of all its rows [m^2].
  Eigen::MatrixXd matrix(const std::vector<Eigen::VectorXd>& rows) const;

 private:
  const GeodesicCalculus& calculus_;
  ShellMeasures mean_;
  std::vector<ShellMeasures> nodes_;  ///< of the spider's arms, the first after the mean
  double steps_;                      ///< K
};

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
