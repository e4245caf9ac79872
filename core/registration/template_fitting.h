#pragma once

#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "core/mesh/topology.h"
#include "core/numerics/solved.h"
#include "core/registration/gates.h"
#include "core/registration/landmark.h"

namespace shaped {

/// How a template may deform; see deformation.h for the energies.
enum class FittingMethod {
  kAffine,        ///< an affine map a vertex, neighbours alike
  kDisplacement,  ///< small displacements (a baseline)
  kEdgeLengths    ///< kept edge lengths (a baseline)
};

/// One scan after another of one kind, or one scan from stiff to soft: everything but scan and template.
struct FittingOptions {
  FittingMethod method = FittingMethod::kAffine;
  double first_stiffness = 0.1;  ///< alpha of the first level, > 0
  double last_stiffness = 1e-5;  ///< of the last, (0, first_stiffness]
  int levels = 6;                ///< geometric from first to last, >= 1
  double turn_length =
      0.1;  ///< l of affineDeformation relative to the template's size (twice the largest distance to its mean), > 0
  CorrespondenceGates gates;        ///< of the last level
  double first_max_distance = 0.3;  ///< m, of the first level (geometric in between), >= gates.max_distance
  RobustLoss loss;       ///< of the last level; its scale starts at first_max_distance / 2 (geometric in between)
  double sliding = 0.9;  ///< 0: to the closest point; 1: to its tangent plane, free to slide in it; [0, 1].
                         ///< The scan's points start at 0 and come to it in the last level
  double coverage = 5;   ///< weight of the scan's points that look for the template, to the template's that look for
                         ///< the scan, >= 0; 0: one-sided as in the papers
  int coverage_points = 4000;     ///< of the scan, >= 1
  double landmark_weight = 0.01;  ///< beta of the first level, falls with the square root of the stiffness, >= 0
  int steps_per_level = 12;       ///< correspondences renewed at most so often, >= 1
  double tolerance = 2e-4;        ///< root mean square motion of a step relative to the size, > 0
  std::optional<std::string> firstViolation() const;  ///< "levels = 0, want >= 1"
};

/// One stiffness.
struct FittingLevel {
  double stiffness;
  Outcome outcome;         ///< residual: the last step's motion, as FittingOptions::tolerance
  double energy_at_start;  ///< m^2, with the level's own gates and loss
  double energy_at_end;
};

/// How a fitted template lies on its scan.
struct FittingReport {
  double median_distance = 0;         ///< m, of the vertices with a correspondence to the scan's tangent planes there
  double percentile_95_distance = 0;  ///< m
  double gated_out = 0;               ///< share of the vertices without a correspondence: there the template is a guess
  double too_far = 0, wrong_normal = 0, at_boundary = 0;  ///< share by cause
  double landmark_distance = 0;                           ///< m, root mean square; 0 without landmarks
  double smallest_area_ratio = 0;  ///< of a triangle to the placed template's (core/mesh/quality.h)
  Eigen::Index flipped = 0;        ///< triangles that turned against their surroundings
};

struct FittedTemplate {
  Vertices vertices;  ///< V x 3, in the scan's place
  std::vector<FittingLevel> levels;
  FittingReport report;
};

/// Deforms a template onto a scan: E = data + alpha R + beta landmarks, from stiff to soft, the correspondences renewed
/// within each level until they settle (Allen, Curless, Popovic 2003; optimal steps: Amberg, Romdhani, Vetter 2007; the
/// use: [Wuh18] chapter 9).
///   data = sum_i a_i rho(r_i^2) over the vertices that pass the gates,  a_i: share of the area,
///   r_i^2 = |n (x_i - y_i)|^2 + (1 - sliding) |the rest of x_i - y_i|^2,  y_i: closest scan point with normal n.
/// Coverage adds the same the other way round, the mean of rho over points of the scan and their closest template
/// vertices: without it a foot that starts above the scan's is content with the shin, and nothing asks for it below.
/// For fixed correspondences each step minimises an upper bound that touches E, so E falls; the coordinates then share
/// one matrix. A vertex left out by the gates adds rho(max_distance^2), so that leaving out is no gain.
///
/// placed: V x 3, where a rigid start put the template. Landmarks with weight 0 do not count.
/// Termination: kConverged when the last level settled; kIterationLimit or kStalled as the last level ended;
/// kCancelled: as far as it came; kNumericalFailure, with `placed`: no vertex passed the gates in the first level, or
/// the system was not definite. Earlier levels need not settle: their outcomes stand in `levels`. Throws InvalidInput
/// naming an option, `placed` (requireValidShape) or `landmarks[i]`.
Solved<FittedTemplate> fitTemplate(const ScanSurface& scan, const Topology& topology, const Vertices& placed,
                                   const std::vector<Landmark>& landmarks, const FittingOptions& options,
                                   const std::stop_token& stop = {});

}  // namespace shaped
