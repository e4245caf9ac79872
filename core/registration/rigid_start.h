#pragma once

#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "core/mesh/alignment.h"
#include "core/numerics/solved.h"
#include "core/registration/landmark.h"
#include "core/registration/scan_surface.h"

namespace shaped {

struct RigidStartOptions {
  int samples = 600;            ///< points of either side that take part, >= 50
  int coarse_steps = 4;         ///< steps of every start before the worse are dropped, >= 1
  int fine_steps = 60;          ///< most steps of each start that is kept, >= 1
  int kept = 4;                 ///< starts that are refined, >= 1
  double tolerance = 1e-4;      ///< of a step: radians, and lengths relative to the template's extent, > 0
  double scan_share = 0.9;      ///< share of the scan that is of the template's surface, (0, 1]; the rest: stray points
  double template_share = 0.5;  ///< share of the template that the scan shows at least, (0, 1]
  double largest_scale = 1.6;   ///< the template may be this much smaller or larger than the scanned thing, >= 1
  double distinct_angle = 30;   ///< degrees; starts that end nearer than this to each other are one, (0, 180]
  std::optional<std::string> firstViolation() const;  ///< "samples = 10, want >= 50"
};

/// Where a template lies on a scan.
struct RigidStart {
  RigidMotion motion;           ///< template -> scan, without the scale
  SimilarityMotion similarity;  ///< template -> scan, with the scale at which it fits best
  double score = 0;             ///< robust root mean square distance of scan and template, m
  RigidMotion runner_up;        ///< the best of the other distinct ways to lie
  double margin = 0;            ///< (runner-up's score - score) / score: near 0 the choice is a guess; infinite without
};

/// Places the template on the scan without landmarks, whatever the scan's placement: iterative closest points both ways
/// (Besl and McKay 1992; to planes: Chen and Medioni 1992; trimmed: Chetverikov, Stepanov, Krsek 2005) from the
/// principal axes turned by every rotation of the icosahedron, since one descent finds the nearest minimum only. A few
/// steps from every start, on few points; the best are then refined to convergence. A scale takes part, since a child
/// and a tall man differ by more than the pose decides; it is not part of `motion`.
///
/// residual: the last step of the best start. kIterationLimit when that was above the tolerance after fine_steps.
/// Throws InvalidInput naming an option out of range, or template faces without area.
Solved<RigidStart> startRigidly(const ScanSurface& scan, const Vertices& template_vertices, const Faces& template_faces,
                                const RigidStartOptions& options = {}, const std::stop_token& stop = {});

/// With landmarks: the motion that brings them together best (alignRigidly), and the similarity. At least three of
/// positive weight that span a plane (InvalidInput). score: root mean square distance of the landmarks under `motion`.
Solved<RigidStart> startFromLandmarks(const std::vector<Landmark>& landmarks, const Vertices& template_vertices,
                                      const Faces& template_faces);

}  // namespace shaped
