#pragma once

#include "core/curve/geodesic_flow.h"

namespace shaped {

struct BezierOptions {
  int frames = 32;  ///< of the curve with both ends, >= 2
  /// Of each geodesic of the construction, >= 2. More of them change the curve far less than the subspace does.
  int auxiliary = 9;
  int dimension = 60;  ///< of the subspace that holds the whole construction at most, before enrichments, >= 1
  /// Of the geodesics; frames is not read. Enrichments and accuracy also say how often, at most, and until when the
  /// whole construction's subspace grows.
  GeodesicFlowOptions geodesic = {};

  std::optional<std::string> firstViolation() const;  ///< "frames = 1, want >= 2"; empty when all is well
};

struct BezierCurve {
  Curve curve;                 ///< its ends are the first and the last control shape themselves
  int geodesics = 0;           ///< that were computed
  Eigen::Index dimension = 0;  ///< of the subspace
  double missing = 0;          ///< as PathEnrichment::missing, of the construction in the middle of the curve
};

/// A Bezier curve in shape space: de Casteljau's algorithm with discrete geodesics for straight lines ([BvTH16] section
/// 7). The point at t of n control shapes is the point at t of the geodesic between the points at t of the first n - 1
/// and of the last n - 1. With two of them it is a geodesic.
///
/// All happens in one subspace: of the geodesics between neighbouring control shapes, enriched by the construction in
/// the middle of the curve (enrich()), and on one ghost mesh. Each geodesic of the construction starts from the one at
/// the t before. Positions in space follow the Bezier curve of the control shapes' positions.
///
/// controls: two or more, V x 3 each, of one component. Throws InvalidInput naming "controls", "controls[i]",
/// "topology" or "options". The outcome adds up all solves. Runs parallel loops in the current TBB arena.
Solved<BezierCurve> bezierCurve(const ShellStructurePtr& structure, double bending,
                                const std::vector<Vertices>& controls, const BezierOptions& options,
                                const ProgressSink& progress = {});

}  // namespace shaped
