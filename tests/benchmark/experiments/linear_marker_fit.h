#pragma once

#include "core/markers/marker_trial.h"
#include "core/mesh/alignment.h"
#include "core/statistics/linear_pca.h"

namespace shaped::experiments {

/// The baseline for marker fitting: the most probable point of a linear PCA model under Gaussian noise,
///   min over rotation R, translation t, weights y of sum_l |R (m_l + B_l y) + t - x_l|^2 / sigma^2 + sum_j y_j^2 /
///   v_j,
/// by alternating the exact rigid motion and the exact ridge solution until they settle. Each frame starts from the
/// last frame's answer and from the mean; the better one is taken.
class LinearMarkerFit {
 public:
  /// vertices: under the markers. noise: sigma [m] per axis, > 0.
  LinearMarkerFit(const LinearPca& pca, int modes, std::vector<std::int32_t> vertices, double noise);

  /// markers: L x 3 [m], a row of NaN where one was not seen. Returns the whole shape, V x 3, where the markers are.
  Vertices fit(const Vertices& markers);

 private:
  struct Candidate {
    Eigen::VectorXd weights;
    RigidMotion motion;  ///< of the model to the markers
    double objective;
  };
  Candidate alternate(const Vertices& markers, const Eigen::VectorXd& seen, Eigen::VectorXd weights) const;
  Vertices markerPoints(const Eigen::VectorXd& weights) const;

  const LinearPca& pca_;
  Eigen::Index modes_;
  double noise_;
  Eigen::VectorXd mean_;   ///< 3L, of the marker vertices
  Eigen::MatrixXd basis_;  ///< 3L x modes
  Eigen::VectorXd last_;   ///< weights of the last frame
};

}  // namespace shaped::experiments
