#pragma once

#include "core/statistics/principal_variations.h"

namespace shaped {

/// A point of the submanifold M_J, (15)-(16) of [HZRS18]: I(mean, q(alpha), 1 / scale).
struct SubmanifoldPoint {
  Eigen::VectorXd alpha;  ///< 2J weights of p_1 .. p_J, p_-1 .. p_-J; >= 0, sum 1
  double scale = 1;       ///< rho of (17), > 0; a projection's is at most 1 / K
};

/// A shape of the submanifold, with the local one that a similar point's solution can start from.
struct SubmanifoldShape {
  Vertices shape;  ///< I(mean, local, 1 / scale), in no particular position
  Vertices local;  ///< q(alpha)
};

/// Projection of one shape, with what a similar shape's projection can start from.
struct SubmanifoldProjection {
  SubmanifoldPoint point;
  Vertices shape;       ///< P[s] (20), in no particular position
  Vertices local;       ///< P_loc[s_loc] (18)
  Path geodesic;        ///< from the mean to s
  double local_energy = 0;  ///< W[s_loc, P_loc[s_loc]] [m^2]
};

struct SubmanifoldOptions {
  int modes = 0;            ///< J to use, 1 .. model's; 0 = all
  double kappa = 0.5;       ///< of (17), in (0, 1)
  int max_iterations = 50;  ///< of the weights' optimisation, >= 1
  /// Of the weights: sqrt(gain that a step promises / W[mean, s_loc]), > 0. Where the submanifold contains the shape,
  /// the inner solves leave gains of 1e-6 that no step can collect.
  double tolerance = 1e-5;
  double shape_tolerance = 1e-8;  ///< of every inner shape solve, > 0
  std::stop_token stop;
};

/// The submanifold "spanned" by principal variations, with its projection and its inverse. Const and safe to share.
class Submanifold {
 public:
  Submanifold(std::shared_ptr<const GeodesicCalculus> calculus, std::shared_ptr<const ShellPga> pga);

  const ShellPga& pga() const { return *pga_; }
  const GeodesicCalculus& calculus() const { return *calculus_; }
  /// Memory of what is kept beside mean and variations: their measures [bytes].
  std::size_t bytes() const;

  /// q(alpha), the minimiser of (26), started from `start`.
  Solved<Vertices> average(const Eigen::VectorXd& alpha, const Vertices& start,
                           const SubmanifoldOptions& options) const;

  /// (17)-(20): scaling, local projection, rescaling. warm: the projection of a similar shape, or null.
  Solved<SubmanifoldProjection> project(const Vertices& shape, const SubmanifoldOptions& options,
                                        const SubmanifoldProjection* warm = nullptr) const;

  /// The shape of a point, (16). near: q(alpha) of a similar point, or null. Throws InvalidInput naming "alpha" or
  /// "scale" when the point is not one of M_J.
  Solved<SubmanifoldShape> shapeOf(const SubmanifoldPoint& point, const SubmanifoldOptions& options,
                                   const Vertices* near = nullptr) const;

  /// Coordinates in the principal components [m]: y_j = (alpha_j - alpha_-j) dist(mean, p_j) / scale, the logarithm of
  /// the point to first order. Their variance over the training shapes is the eigenvalue.
  Eigen::VectorXd tangentCoordinates(const SubmanifoldPoint& point) const;

  /// A point with these tangent coordinates (J entries [m]): the inverse of tangentCoordinates with the fewest weights.
  SubmanifoldPoint pointOf(const Eigen::VectorXd& tangent_coordinates) const;

 private:
  struct LocalProjection;
  std::vector<std::size_t> vertexIndices(int modes) const;
  /// min_j dist(mean, p_j) over the first `modes` variations [m].
  double nearestVariation(std::size_t modes) const {
    return distances_.head(static_cast<Eigen::Index>(modes)).minCoeff();
  }
  Solved<SubmanifoldPoint> optimiseWeights(const ShellMeasures& target, const std::vector<std::size_t>& vertices,
                                           Eigen::VectorXd start, const SubmanifoldOptions& options, Vertices& q,
                                           double& energy) const;
  /// I(mean, local, 1 / scale) in K steps, or more where K do not get there.
  Solved<Vertices> rescale(const Vertices& local, double scale, const SubmanifoldOptions& options) const;
  Solved<Vertices> march(const Vertices& local, double scale, int steps, const SubmanifoldOptions& options) const;

  std::shared_ptr<const GeodesicCalculus> calculus_;
  std::shared_ptr<const ShellPga> pga_;
  std::vector<ShellMeasures> measures_;  ///< of the variations
  Eigen::VectorXd distances_;            ///< dist(mean, p_j), one segment each, J entries [m]
  Eigen::VectorXd forces_;               ///< |W,2[p_j, mean]|, 2J entries: reference for balances
};

}  // namespace shaped
