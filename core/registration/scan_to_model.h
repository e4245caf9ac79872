#pragma once

#include <stop_token>
#include <string>
#include <vector>

#include "core/body/body_fit.h"
#include "core/mesh/alignment.h"
#include "core/registration/gates.h"
#include "core/registration/landmark.h"

namespace shaped {

/// One step from coarse to fine.
struct ModelFitLevel {
  int points;           ///< of either side that take part, >= 50; all where there are fewer
  double max_distance;  ///< gate, m, > 0
  double loss_scale;    ///< of the robust loss, m, > 0
  double sigma;         ///< BodyFitOptions::sigma, m, > 0
  bool to_planes;       ///< distances along normals (fast near the answer), else between points (sure far from it)
  int rounds;           ///< correspondences are renewed at most so often, >= 1
};

struct ModelFitOptions {
  std::vector<ModelFitLevel> levels = {{500, 0.40, 0.15, 0.050, false, 12},
                                       {1000, 0.20, 0.06, 0.020, true, 12},
                                       {3000, 0.10, 0.03, 0.008, true, 10},
                                       {20000, 0.05, 0.015, 0.005, true, 12}};
  double max_normal_angle = 60;  ///< gate, degrees, (0, 180]
  bool reject_boundary = true;   ///< gate
  bool identity = true;          ///< whether the identity may change, or the pose alone
  double pose_deviation = 0.2;   ///< BodyFitOptions; for scans near the rest pose, people in motion want about 1
  double observations = 1000;    ///< BodyFitOptions
  double landmark_weight = 1;    ///< of all landmarks together, relative to one side of the scan, >= 0
  double tolerance = 1e-4;       ///< of a round: root mean square motion of the model's vertices, m, > 0
  std::stop_token stop = {};

  std::optional<std::string> firstViolation() const;  ///< "levels[0].points = 3, want >= 50"
};

/// Distances of one part of the body: of the vertices that its bone carries foremost.
struct RegionResidual {
  std::string name;      ///< of the joint
  double seen;           ///< share of its vertices with a scan point that passes the gates
  double mean_distance;  ///< of those, to the scan's tangent plane, m; 0 where none is seen
};

/// How a model lies on a scan.
struct ModelFitReport {
  double scan_median = 0, scan_mean = 0, scan_95 = 0;  ///< of the scan's points to the model's surface, m
  double model_mean = 0;                               ///< of the model's vertices with a correspondence to the scan, m
  double explained = 0;                                ///< share of the scan's points that pass the gates
  double seen = 0;                                     ///< share of the model's vertices that do
  double chamfer = 0;  ///< (3.2) of [Mur25]: mean distance of both ways, m, gates left aside
  std::vector<RegionResidual> regions;
};

struct ModelFit {
  BodyState state;
  ModelFitReport report;
};

/// Identity and pose together on the two-sided distance of scan and model, (3.2) of [Mur25]: closest points both ways
/// under gates and a robust loss, then Levenberg-Marquardt steps (fitBody) with those pairs, renewed until the surface
/// stands still; from few points and wide gates to many and narrow ones.
///
/// start: where the model lies roughly (placedState). The residual is the last round's motion of the surface; converged
/// when the last level settled. kStalled when no point passed the gates of a level, with the last state that had some.
/// Throws InvalidInput naming an option, the start, or `landmarks[i]`.
Solved<ModelFit> fitModelToScan(const ScanSurface& scan, const BodyModel& model, const BodyState& start,
                                const std::vector<Landmark>& landmarks, const ModelFitOptions& options = {});

/// The same without the report.
Solved<BodyState> fitStateToScan(const ScanSurface& scan, const BodyModel& model, const BodyState& start,
                                 const std::vector<Landmark>& landmarks, const ModelFitOptions& options = {});

/// The mean body where a rigid motion carries it.
BodyState placedState(const BodyModel& model, const RigidMotion& motion);
/// A body moved rigidly as a whole.
BodyState carried(const BodyModel& model, const BodyState& state, const RigidMotion& motion);

}  // namespace shaped
