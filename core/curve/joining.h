#pragma once

#include <optional>

#include "core/curve/geodesic_flow.h"
#include "core/curve/smoothing.h"

namespace shaped {

struct JoinOptions {
  /// Frames between the last of a clip and the first of the next, of a geodesic; none where these agree. Not given: as
  /// many as keep the speed of the clips on either side, at most 60.
  std::optional<int> transition = {};
  /// The direction that stays up: a clip turns about it alone and keeps its height. Not given: any rigid motion, so
  /// that the shapes at the seam lie on each other as well as they can.
  std::optional<Eigen::Vector3d> up = {};
  int reach = 20;              ///< frames of each clip next to a seam that may change, >= 0
  SmoothingOptions smoothing;  ///< held and restore are not read
  GeodesicFlowOptions geodesic;

  std::optional<std::string> firstViolation() const;  ///< "reach = -1, want >= 0"; empty when all is well
};

/// Clips one after the other.
struct Concatenation {
  Curve curve;
  /// Of each seam: the last frame of the clip before and the first of the one after; one and the same where they agree.
  std::vector<std::pair<std::size_t, std::size_t>> seams;
};

struct JoinedClips {
  Curve curve;
  std::vector<std::pair<std::size_t, std::size_t>> seams;
  int steps = 0;                                         ///< that were taken, around the seam with the fewest
  bool stationary = false;                               ///< nothing more to gain around any seam
  double path_energy_before = 0, path_energy_after = 0;  ///< (4) of the concatenation and of what became of it [m^2]
  std::vector<double> gradient_before, gradient_after;   ///< gradientNorms() of both
};

/// Each clip is moved rigidly so that its first frame lies on the last one of the clip before, and frames are put in
/// between. Outcome: of the geodesics.
/// Throws InvalidInput naming "clips", "clips[k]", "clips[k][i]", "topology" or "options".
Solved<Concatenation> concatenated(const ShellStructurePtr& structure, double bending,
                                   const std::vector<std::vector<Vertices>>& clips, const JoinOptions& options);

/// Concatenated and smoothed around the seams ([BvTH16] section 7): the flow rounds the corners off; frames further
/// from every seam than the reach stay as they are. Outcome: of geodesics and smoothing.
Solved<JoinedClips> joined(const ShellStructurePtr& structure, double bending,
                           const std::vector<std::vector<Vertices>>& clips, const JoinOptions& options,
                           const ProgressSink& progress = {});

}  // namespace shaped
