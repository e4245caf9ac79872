#include "core/statistics/gram.h"

#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>

#include "core/shell/energy.h"

namespace shaped {

Eigen::MatrixXd gramMatrix(const GeodesicCalculus& calculus, const Spider& spider) {
  const auto& topology = calculus.topology();
  const auto n = static_cast<Eigen::Index>(spider.arms.size());
  const double steps = static_cast<double>(spider.arms.front().size() - 1);  // 1 / sigma
  std::vector<ShellMeasures> nodes(spider.arms.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) measure(topology, spider.arms[i][1], nodes[i]);
  const auto mean = measure(topology, spider.mean);

  Eigen::VectorXd own(n);
  Eigen::MatrixXd cross(n, n);  // W[s_1^i, s_1^j]
  tbb::parallel_for(Eigen::Index{0}, n, [&](Eigen::Index i) {
    const auto& node = nodes[static_cast<std::size_t>(i)];
    own[i] = calculus.energy().value(topology, mean, node);
    for (Eigen::Index j = 0; j < n; ++j)
      cross(i, j) = i == j ? 0 : shellEnergy(topology, node, nodes[static_cast<std::size_t>(j)], calculus.bending());
  });
  Eigen::MatrixXd gram(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j)
      gram(i, j) = (own[i] + own[j] - 0.5 * (cross(i, j) + cross(j, i))) * steps * steps / (2 * static_cast<double>(n));
  return gram;
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
