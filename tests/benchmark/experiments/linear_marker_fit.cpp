#include "tests/benchmark/experiments/linear_marker_fit.h"

#include <Eigen/Cholesky>

namespace shaped::experiments {

LinearMarkerFit::LinearMarkerFit(const LinearPca& pca, int modes, std::vector<std::int32_t> vertices, double noise)
    : pca_(pca),
      modes_(std::min<Eigen::Index>(modes, pca.modes.cols())),
      noise_(noise),
      mean_(3 * static_cast<Eigen::Index>(vertices.size())),
      basis_(mean_.size(), modes_),
      last_(Eigen::VectorXd::Zero(modes_)) {
  for (std::size_t l = 0; l < vertices.size(); ++l) {
    const auto row = 3 * static_cast<Eigen::Index>(l);
    mean_.segment<3>(row) = pca.mean.row(vertices[l]).transpose();
    basis_.middleRows<3>(row) = pca.modes.block(3 * vertices[l], 0, 3, modes_);
  }
}

Vertices LinearMarkerFit::markerPoints(const Eigen::VectorXd& weights) const {
  const Eigen::VectorXd points = mean_ + basis_ * weights;
  return Eigen::Map<const Vertices>(points.data(), points.size() / 3, 3);
}

LinearMarkerFit::Candidate LinearMarkerFit::alternate(const Vertices& markers, const Eigen::VectorXd& seen,
                                                      Eigen::VectorXd weights) const {
  const Eigen::VectorXd row_seen = seen.replicate(1, 3).transpose().reshaped();
  const Eigen::MatrixXd weighted = row_seen.asDiagonal() * basis_;
  const Eigen::VectorXd ridge = noise_ * noise_ * pca_.values.head(modes_).cwiseInverse();
  const Eigen::LLT<Eigen::MatrixXd> normal(Eigen::MatrixXd(basis_.transpose() * weighted) +
                                           Eigen::MatrixXd(ridge.asDiagonal()));
  Candidate result{std::move(weights), {}, std::numeric_limits<double>::infinity()};
  for (int round = 0; round < 2000; ++round) {
    const auto to_model = alignRigidly(markers, markerPoints(result.weights), seen);
    Vertices wanted = apply(to_model, markers);
    for (Eigen::Index l = 0; l < wanted.rows(); ++l)
      if (seen[l] == 0) wanted.row(l).setZero();
    const Eigen::VectorXd offset = wanted.reshaped<Eigen::RowMajor>() - mean_;
    result.weights = normal.solve(weighted.transpose() * offset);
    const Eigen::VectorXd misfit = row_seen.asDiagonal() * (basis_ * result.weights - offset);
    const double objective = misfit.squaredNorm() + result.weights.cwiseAbs2().dot(ridge);
    result.motion = inverse(to_model);
    const bool settled = result.objective - objective < 1e-9 * objective;
    result.objective = objective;
    if (settled) break;
  }
  return result;
}

Vertices LinearMarkerFit::fit(const Vertices& markers) {
  Eigen::VectorXd seen(markers.rows());
  for (Eigen::Index l = 0; l < markers.rows(); ++l) seen[l] = markers.row(l).allFinite() ? 1 : 0;
  const auto warm = alternate(markers, seen, last_), cold = alternate(markers, seen, Eigen::VectorXd::Zero(modes_));
  const auto& best = warm.objective <= cold.objective ? warm : cold;
  last_ = best.weights;
  const Eigen::VectorXd model = pca_.mean.reshaped<Eigen::RowMajor>() + pca_.modes.leftCols(modes_) * best.weights;
  return apply(best.motion, Eigen::Map<const Vertices>(model.data(), pca_.mean.rows(), 3));
}

}  // namespace shaped::experiments
