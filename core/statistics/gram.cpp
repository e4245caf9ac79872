#include "core/statistics/gram.h"

#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <utility>

#include "core/shell/energy.h"

namespace shaped {

GramEnergies::GramEnergies(const GeodesicCalculus& calculus, const Spider& spider)
    : calculus_(calculus),
      mean_(measure(calculus.topology(), spider.mean)),
      nodes_(spider.arms.size()),
      steps_(static_cast<double>(spider.arms.front().size() - 1)) {
  for (std::size_t i = 0; i < nodes_.size(); ++i) measure(calculus.topology(), spider.arms[i][1], nodes_[i]);
}

Eigen::VectorXd GramEnergies::row(std::size_t i) const {
  const auto& topology = calculus_.topology();
  Eigen::VectorXd energies(static_cast<Eigen::Index>(nodes_.size()));
  for (std::size_t j = 0; j < nodes_.size(); ++j)
    energies[static_cast<Eigen::Index>(j)] = i == j
                                                 ? calculus_.energy().value(topology, mean_, nodes_[i])
                                                 : shellEnergy(topology, nodes_[i], nodes_[j], calculus_.bending());
  return energies;
}

Eigen::MatrixXd GramEnergies::matrix(const std::vector<Eigen::VectorXd>& rows) const {
  const auto n = static_cast<Eigen::Index>(rows.size());
  Eigen::VectorXd own(n);
  Eigen::MatrixXd cross(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    cross.row(i) = rows[static_cast<std::size_t>(i)];
    own[i] = std::exchange(cross(i, i), 0);
  }
  Eigen::MatrixXd gram(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j)
      gram(i, j) =
          (own[i] + own[j] - 0.5 * (cross(i, j) + cross(j, i))) * steps_ * steps_ / (2 * static_cast<double>(n));
  return gram;
}

Eigen::MatrixXd gramMatrix(const GeodesicCalculus& calculus, const Spider& spider) {
  const GramEnergies energies(calculus, spider);
  std::vector<Eigen::VectorXd> rows(spider.arms.size());
  tbb::parallel_for(std::size_t{0}, rows.size(), [&](std::size_t i) { rows[i] = energies.row(i); });
  return energies.matrix(rows);
}

Spectrum spectrum(const Eigen::MatrixXd& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(symmetric);
  Spectrum result{eigen.eigenvalues().reverse(), eigen.eigenvectors().rowwise().reverse()};
  for (Eigen::Index j = 0; j < result.vectors.cols(); ++j) {
    Eigen::Index largest;
    result.vectors.col(j).cwiseAbs().maxCoeff(&largest);
    if (result.vectors(largest, j) < 0) result.vectors.col(j) = -result.vectors.col(j);
  }
  return result;
}

}  // namespace shaped
