#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>

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
  Vertices shape;           ///< P[s] (20), in no particular position
  Vertices local;           ///< P_loc[s_loc] (18)
  Path geodesic;            ///< from the mean to s
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
/// What it derives from a variation (measures, distance, reference force) is computed when it is first wanted, and
/// kept.
class Submanifold {
 public:
  /// A shape on the calculus's mesh for a variation of the model.
  using Refine = std::function<Vertices(const Vertices&)>;

  /// refine: carries the variations of `pga`, whose mean is on the calculus's mesh, there as well, whenever one is
  /// first used, from any thread; empty: they are there.
  Submanifold(std::shared_ptr<const GeodesicCalculus> calculus, std::shared_ptr<const ShellPga> pga,
              Refine refine = {});

  const ShellPga& pga() const { return *pga_; }
  const GeodesicCalculus& calculus() const { return *calculus_; }
  const std::shared_ptr<const GeodesicCalculus>& calculusPtr() const { return calculus_; }
  /// p_j, or p_-j for j >= J, on the calculus's mesh.
  Vertices variation(std::size_t j) const;
  /// Memory of what is kept beside mean and variations once all of these have been used [bytes].
  std::size_t bytes() const;
  /// How many variations have been used so far: what a request has to pay for.
  std::size_t derivedVariations() const;

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
  /// What follows from one variation, made once by whoever first wants it; read without a lock afterwards.
  struct Derived {
    std::once_flag once;
    std::atomic<bool> done = false;
    ShellMeasures measures;
    double distance = 0;  ///< dist(mean, p_j), one segment [m]; of reflections not used
    double force = 0;     ///< |W,2[p_j, mean]|: reference for balances
  };
  const Derived& derived(std::size_t j) const;
  void derive(std::size_t j, Derived& result) const;
  /// Derives what is missing of these variations; false when the token fires before all are there.
  bool prepare(const std::vector<std::size_t>& vertices, const std::stop_token& stop) const;
  double distance(Eigen::Index j) const { return derived(static_cast<std::size_t>(j)).distance; }

  /// What stands for a projection that was cancelled before it began.
  SubmanifoldProjection meanProjection() const;
  std::vector<std::size_t> vertexIndices(int modes) const;
  /// min_j dist(mean, p_j) over the first `modes` variations [m].
  double nearestVariation(std::size_t modes) const;
  Solved<SubmanifoldPoint> optimiseWeights(const ShellMeasures& target, const std::vector<std::size_t>& vertices,
                                           Eigen::VectorXd start, const SubmanifoldOptions& options, Vertices& q,
                                           double& energy) const;
  /// I(mean, local, 1 / scale) in K steps, or more where K do not get there.
  Solved<Vertices> rescale(const Vertices& local, double scale, const SubmanifoldOptions& options) const;
  Solved<Vertices> march(const Vertices& local, double scale, int steps, const SubmanifoldOptions& options) const;

  std::shared_ptr<const GeodesicCalculus> calculus_;
  std::shared_ptr<const ShellPga> pga_;
  Refine refine_;
  ShellMeasures mean_measures_;
  double force_floor_;                  ///< added to every reference force
  std::unique_ptr<Derived[]> derived_;  ///< of the 2J variations
};

}  // namespace shaped
