#pragma once

#include <array>
#include <memory>

#include "core/body/body_model.h"
#include "core/markers/marker_set.h"
#include "core/model/take_fitter.h"

namespace shaped {

/// Fits a take of markers with a body model: a few steps of iteratively reweighted least squares a frame (the robust
/// loss of Geman and McClure), each by fitBody, with the markers' offsets turned as the skin under them stands. The
/// first frame begins with a loss as wide as the body, which then narrows (graduated non-convexity, Blake and Zisserman
/// 1987): at rest, limbs are far from their markers. The
/// subject stays the same person: the identity is what the calibration frames say in the mean, or the first frame, and
/// then only the pose changes. Bodies have their size in their identity, so that there is no scale.
class BodyTakeFitter final : public TakeFitter {
 public:
  /// Throws InvalidInput naming markers[i] with a place that is not of the model, "marker_set" with fewer than three,
  /// or the option at fault.
  BodyTakeFitter(std::shared_ptr<const BodyModel> model, const MarkerSet& markers, const TakeOptions& options);

  /// The identity as the mean of what each frame says on its own, weighted by the inverse square of its residual.
  Outcome calibrate(const std::vector<MarkerPositions>& frames) override;
  Solved<TakeFrame> fit(const MarkerPositions& markers) override;
  Keep state() const override;
  std::int64_t resume(const std::filesystem::path& path) override;

 private:
  /// A marker: over a point of the skin, by an offset in the axes of the mean at rest.
  struct Site {
    std::array<std::int32_t, 3> corners;
    Eigen::Vector3d barycentric, offset;
  };
  /// What the next frame starts from.
  struct State {
    bool started = false, known = false;  ///< a frame has been fitted; the identity is settled
    BodyState body;
  };

  static Site siteOf(const BodyModel& model, const MarkerSet::Marker& marker, const std::string& field);
  bool placeable(const MarkerPositions& markers, const std::string& field) const;
  /// Where the markers of a posed body are, L x 3, and their offsets.
  struct Places {
    Vertices markers, offsets;
  };
  Places placesOn(const BodyState& body) const;
  BodyState rigidStart(const MarkerPositions& markers) const;
  Eigen::VectorXd distances(const MarkerPositions& markers, const BodyState& body) const;
  Eigen::VectorXd weights(const Eigen::VectorXd& distances, double least_scale) const;
  Solved<BodyState> fitFrom(BodyState start, const MarkerPositions& markers, bool identity, int rounds,
                            double scale) const;

  const std::shared_ptr<const BodyModel> whole_;
  const BodyModel model_;  ///< of the modes that are used
  std::vector<Site> sites_;
  const TakeOptions options_;
  const double size_;
  State state_;
};

}  // namespace shaped
