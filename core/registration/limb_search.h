#pragma once

#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "core/body/body_model.h"
#include "core/registration/scan_surface.h"

namespace shaped {

struct LimbSearchOptions {
  int samples = 500;            ///< points of either side that take part, >= 50
  double loss_scale = 0.05;     ///< a point so far away counts half of one that has no partner, m, > 0
  double largest_share = 0.25;  ///< of the surface that a limb's upper joint may carry, (0, 1]
  double shortest_bone = 0.1;   ///< of the model's extent: upper joint to lower, > 0
  double prior = 0.04;          ///< what a joint turned by one radian costs; a limb without a partner costs 2, >= 0
  double least_gain = 0.02;     ///< what a turn must save to be taken, in the same measure, >= 0
  bool backwards =
      false;  ///< the last limb first: limbs that cross may be told apart in one order and not in the other
  std::optional<std::string> firstViolation() const;  ///< "samples = 10, want >= 50"
};

/// A limb as the search turns it.
struct Limb {
  std::int32_t upper, lower;  ///< joints; lower is a child of upper
};

/// The limbs of a model, those nearer to the root first: upper joints carry at most `largest_share` of the surface, and
/// the lower one stands at least `shortest_bone` away. Throws InvalidInput naming an option.
std::vector<Limb> limbsOf(const BodyModel& model, const LimbSearchOptions& options = {});

/// Whether a joint is `ancestor` or hangs below it.
bool hangsBelow(const Skeleton& skeleton, std::int32_t joint, std::int32_t ancestor);

/// What a search found.
struct LimbSearch {
  BodyState state;
  int turned = 0;  ///< limbs that it turned
};

/// Seats limbs that a descent has missed. Closest points pull a bent arm, or a leg that strides out, to whatever lies
/// nearest, and it stays there; so each limb (a joint that carries a small part of the body, and the next joint along
/// its bone) is turned by a grid of rotations of both joints, the rest of the body held, and the best is taken. The
/// cost of a grid point is the robust mean distance both ways: of the limb's points to the scan, and of the scan's
/// points to the whole body, points that face another way having no partner. From the trunk outwards: upper arm before
/// forearm. A coarse answer (steps of 25 degrees), to be refined by fitModelToScan.
///
/// start: trunk and head roughly right. Joints stay in the model's limits. Throws InvalidInput naming an option or the
/// start.
LimbSearch searchLimbs(const ScanSurface& scan, const BodyModel& model, const BodyState& start,
                       const LimbSearchOptions& options = {}, const std::stop_token& stop = {});

}  // namespace shaped
