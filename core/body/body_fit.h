#pragma once

#include <array>
#include <span>
#include <stop_token>

#include "core/body/body_model.h"
#include "core/numerics/solved.h"

namespace shaped {

/// A point of the model's surface and where it should be.
struct SurfaceTarget {
  std::array<std::int32_t, 3> corners;               ///< vertices of the model
  Eigen::Vector3d barycentric;                       ///< their shares, sum 1
  Eigen::Vector3d position;                          ///< the target, m
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit: the distance along it counts; zero: all directions do
  double weight = 1;                                 ///< of the squared distance, >= 0
};

struct BodyFitOptions {
  double sigma = 0.005;         ///< distance that costs as much as one standard deviation of one mode, m, > 0
  double observations = 1000;   ///< what all targets count for together: neighbours err alike, > 0
  double pose_deviation = 0.5;  ///< standard deviation of a joint's axis-angle components about rest, rad, > 0
  double prior = 1;             ///< factor of identity's and pose's priors, >= 0
  bool identity = true;         ///< whether the identity may change
  bool pose = true;             ///< whether joints may turn
  bool placement = true;        ///< whether the root may turn and move
  bool limits = true;           ///< whether the model's joint limits hold
  int max_iterations = 50;      ///< >= 1
  double tolerance = 1e-6;      ///< of the energy's relative change in a step, > 0
  std::stop_token stop = {};

  std::optional<std::string> firstViolation() const;  ///< "sigma = 0, want > 0"
};

/// The state that minimises
///   N / sum w  sum_i w_i d_i^2 / sigma^2 + prior (|identity|^2 + sum over joints but the root |w_j|^2 /
///   pose_deviation^2)
/// by Levenberg and Marquardt's method (Ceres) with analytic derivatives; N is `observations`, d_i the distance of
/// target i from its point, along its normal where it has one. Joints stay in the model's limits; a start outside is
/// moved in.
///
/// The residual is the relative change of the energy in the last step; converged also where a step would move no
/// parameter by more than 1e-12 of their length, whatever the energy does. Without a target of positive weight only the
/// priors speak. Throws InvalidInput naming the option, `start`, or `targets[i]` with a vertex that is not the model's,
/// shares that do not sum to 1, or a number that is not finite.
Solved<BodyState> fitBody(const BodyModel& model, const BodyState& start, std::span<const SurfaceTarget> targets,
                          const BodyFitOptions& options = {});

/// One person in several poses.
struct BodySequence {
  Eigen::VectorXd identity;  ///< k
  std::vector<Pose> poses;
};

/// The same for several frames with one identity: the energies of the frames add up, the identity's prior counts once.
/// targets: one list a frame, at least one frame. The effort of a step grows with the number of frames that may move to
/// the power of three; with `pose` and `placement` off only the identity is solved for, and any number of frames goes.
Solved<BodySequence> fitBodies(const BodyModel& model, const BodySequence& start,
                               std::span<const std::vector<SurfaceTarget>> targets, const BodyFitOptions& options = {});

/// One target a vertex: a shape in correspondence, V x 3.
std::vector<SurfaceTarget> vertexTargets(const Vertices& shape);

}  // namespace shaped
