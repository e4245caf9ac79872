#pragma once

#include <limits>
#include <optional>
#include <string>

#include "core/editing/anchored_fit.h"
#include "core/editing/projection_accelerator.h"
#include "core/statistics/submanifold.h"

namespace shaped {

/// Positions of L markers in one frame, L x 3 [m]; a row of NaN is a marker that was not seen.
using MarkerPositions = Vertices;

/// Where one marker sits: over a point of the surface, by an offset that turns with the patch of surface around it.
///
/// The patch is wide enough to turn steadily; hung on a single triangle, a marker on a bar would wring that triangle.
struct MarkerSite {
  Anchor skin;                                       ///< the point on the surface
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< from there to the marker, in the axes of the template [m]
  std::vector<std::int32_t> patch;                   ///< vertices around it; not needed where the offset is zero
  Vertices patch_template;                           ///< their positions on the template
};

struct MarkerTrackerOptions {
  double prior_weight = 1;  ///< gamma of (22), > 0
  /// Distance at which a marker's pull is quartered, over the model's size; 0 = least squares.
  double robust_scale = 0.05;
  int alternations = 1;         ///< projections a frame after the first, >= 1
  int first_alternations = 30;  ///< at most, in the first frame, >= 1
  std::optional<double> scale;  ///< size of the subject over that of the model; estimated where not given
  /// Looser than elsewhere: the markers' own error is far above what this costs.
  SubmanifoldOptions submanifold{.tolerance = 1e-3, .shape_tolerance = 1e-5, .stop = {}};

  /// "prior_weight = 0, want > 0"; empty when all is well.
  std::optional<std::string> firstViolation() const;
};

/// One fitted frame.
struct MarkerFit {
  Vertices shape;             ///< s, placed and scaled as the markers
  Vertices projection;        ///< P[s], likewise
  SubmanifoldPoint point;     ///< of the projection
  Eigen::VectorXd residuals;  ///< per marker, distance to its point on the shape [m]; NaN where not seen
  Eigen::VectorXd weights;    ///< per marker, of the robust loss, in [0, 1]; 0 where not seen
  double rms = 0;             ///< over the markers seen [m]
  double scale = 1;           ///< of the model
  double prior_energy = 0;    ///< W[s, P[s]] of the unscaled shapes [m^2]
  bool held = false;          ///< too few markers were seen: the last frame's shape is repeated
};

/// What the next frame of a sequence starts from: all that a tracker needs to go on in another process.
struct MarkerTrackerState {
  bool started = false;             ///< the first frame has been fitted
  std::optional<double> calibrated; ///< the subject's size, where it is settled
  double scale = 1;                 ///< of the last frame
  Vertices shape;                   ///< s, unscaled, placed as the scaled-down markers
  Vertices prior;                   ///< P[s]
  SubmanifoldProjection projection;
};

/// Fits a sequence of marker frames by the alternating scheme for (22) of [HZRS18]: s for fixed P[s], then P[s]; each
/// frame starts from the last one. The first frame, and each that calibrates the size, is placed and scaled by a robust
/// similarity of the mean's marker points. While a shape has yet to follow its markers, they are judged outliers at
/// three times their median residual; after that at the robust scale.
///
/// Keeps the state of one sequence; one object per sequence and thread.
class MarkerTracker {
 public:
  /// sites: where the markers sit on the model's coarse mesh, at least three. Throws InvalidInput naming "marker_set"
  /// or the option at fault.
  MarkerTracker(std::shared_ptr<const Submanifold> submanifold, std::vector<MarkerSite> sites,
                MarkerTrackerOptions options);

  /// Estimates the size of the subject from several frames, before the first fit(): the geometric mean of what each of
  /// them says on its own, weighted by the inverse square of the robust fitting energy that it ends with. A frame that
  /// the model does not explain, or that was aligned wrongly, hardly counts. Nothing changes where a scale was given or
  /// no frame converges; then the first fitted frame tells the size. Throws InvalidInput naming calibration[i] when
  /// that frame has not L rows or does not determine a placement.
  Outcome calibrate(const std::vector<MarkerPositions>& frames);

  /// Fits the next frame. Throws InvalidInput naming "markers" when the frame has not L rows, or when it is the first
  /// and fewer than three markers, or only markers on one line, were seen.
  Solved<MarkerFit> fit(const MarkerPositions& markers);

  /// Between two frames.
  MarkerTrackerState state() const;
  /// Goes on from a state of a tracker with the same submanifold, sites and options, as if it had fitted that one's
  /// frames. Throws InvalidInput naming "state" when its shapes are of another mesh.
  void resume(MarkerTrackerState state);

 private:
  /// Everything that belongs to the current frame, and what the next one starts from.
  struct State {
    double scale = 1;
    std::vector<AnchorTarget> targets;  ///< of the current frame: scaled-down markers without their offsets
    Vertices markers;                   ///< of the current frame, scaled down; zero where not seen
    Vertices shape;                     ///< s, unscaled, placed as the scaled-down markers
    Vertices prior;                     ///< P[s]
    SubmanifoldProjection projection;
    double energy = 0;  ///< robustEnergy() at the end of a round
  };

  void takeMarkers(const MarkerPositions& markers, const std::string& field);
  bool placeable();
  Vertices modelPoints(const Vertices& shape) const;
  Eigen::Vector3d offsetOn(const Vertices& shape, const MarkerSite& site) const;
  void followRigidly();
  double robustDistance() const { return options_.robust_scale * size_; }
  void updateWeights(double distance);
  double medianResidual() const;
  double tolerantDistance() const;
  void place(bool estimate_scale);
  void updateScale();
  void rescale(double ratio);
  double neighbourRatio() const;
  Outcome fitShape();
  Outcome projectShape();
  double robustEnergy(double distance) const;
  Outcome round(bool estimate_scale);
  bool lookAhead(const ProjectionAccelerator& accelerator, ProjectionAccelerator::State& start);
  Outcome alternate(bool estimate_scale, double hopeless_energy = std::numeric_limits<double>::infinity());
  Outcome firstFrame();
  Outcome nextFrame();
  MarkerFit report() const;

  std::shared_ptr<const Submanifold> submanifold_;
  std::vector<MarkerSite> sites_;
  MarkerTrackerOptions options_;
  double size_;  ///< of the mean [m]
  bool started_ = false;
  State state_;
};

}  // namespace shaped
