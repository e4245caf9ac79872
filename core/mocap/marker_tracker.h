#pragma once

#include <optional>
#include <string>

#include "core/editing/anchored_fit.h"
#include "core/statistics/submanifold.h"

namespace shaped {

/// Positions of L markers in one frame, L x 3 [m]; a row of NaN is a marker that was not seen.
using MarkerPositions = Vertices;

struct MarkerTrackerOptions {
  double prior_weight = 0.1;    ///< gamma of (22), > 0
  double robust_scale = 0.05;   ///< distance at which a marker's pull is quartered, over the model's size; 0 = least squares
  int alternations = 1;         ///< projections a frame after the first, >= 1
  int first_alternations = 10;  ///< at most, in the first frame, >= 1
  std::optional<double> scale;  ///< size of the subject over that of the model; estimated where not given
  SubmanifoldOptions submanifold;

  /// "prior_weight = 0, want > 0"; empty when all is well.
  std::optional<std::string> firstViolation() const;
};

/// One fitted frame.
struct MarkerFit {
  Vertices shape;                    ///< s, placed and scaled as the markers
  Vertices projection;               ///< P[s], likewise
  SubmanifoldPoint point;            ///< of the projection
  Eigen::VectorXd residuals;         ///< per marker, distance to its point on the shape [m]; NaN where not seen
  Eigen::VectorXd weights;           ///< per marker, of the robust loss, in [0, 1]; 0 where not seen
  double rms = 0;                    ///< over the markers seen [m]
  double scale = 1;                  ///< of the model
  double prior_energy = 0;           ///< W[s, P[s]] of the unscaled shapes [m^2]
  bool held = false;                 ///< too few markers were seen: the last frame's shape is repeated
};

/// Fits a sequence of marker frames by the alternating scheme for (22) of [HZRS18]: s for fixed P[s], then P[s]; each
/// frame starts from the last one. The first frame is placed and scaled by a similarity of the mean's marker points.
///
/// Keeps the state of one sequence; one object per sequence and thread.
class MarkerTracker {
 public:
  /// anchors: where the markers sit on the model's surface, at least three. Throws InvalidInput naming "marker_set" or
  /// the option at fault.
  MarkerTracker(std::shared_ptr<const Submanifold> submanifold, std::vector<Anchor> anchors, MarkerTrackerOptions options);

  /// Fits the next frame. Throws InvalidInput naming "markers" when the frame has not L rows, or when it is the first
  /// and fewer than three markers, or only markers on one line, were seen.
  Solved<MarkerFit> fit(const MarkerPositions& markers);

 private:
  std::vector<AnchorTarget> targetsOf(const MarkerPositions& markers) const;
  void place(const std::vector<AnchorTarget>& targets);
  void followRigidly(const std::vector<AnchorTarget>& targets);
  void updateWeights(std::vector<AnchorTarget>& targets) const;
  Outcome fitShape(std::vector<AnchorTarget>& targets);
  Outcome projectShape();
  void updateScale(std::vector<AnchorTarget>& targets, const MarkerPositions& markers);
  Outcome firstFrame(std::vector<AnchorTarget>& targets, const MarkerPositions& markers);
  Outcome nextFrame(std::vector<AnchorTarget>& targets);
  MarkerFit report(const std::vector<AnchorTarget>& targets) const;

  std::shared_ptr<const Submanifold> submanifold_;
  std::vector<Anchor> anchors_;
  MarkerTrackerOptions options_;
  double size_;       ///< of the mean [m]
  double scale_ = 1;
  bool started_ = false;
  Vertices shape_;    ///< s, unscaled, placed as the scaled-down markers
  Vertices prior_;    ///< P[s]
  SubmanifoldProjection projection_;
};

}  // namespace shaped
