#pragma once

#include <span>

#include "core/registration/limb_search.h"
#include "core/registration/part_fit.h"

namespace shaped {

struct ExtremityOptions {
  PartFitOptions fit;
  int starts = 3;             ///< of the turns tried, so many are descended from, >= 1
  double least_gain = 0.005;  ///< what a turn must save to be taken, in the measure of PartFit::cost, >= 0
  std::optional<std::string> firstViolation() const;  ///< "starts = 0, want >= 1"
};

/// The joints at which hands and feet begin: the lower joints of limbs (limbsOf) at which no other limb begins.
std::vector<std::int32_t> extremitiesOf(std::span<const Limb> limbs);

/// Seats one hand or foot by itself, the rest of the body held. Closest points leave a hand palm up, fingers folded, or
/// on the wrong sheet of skin; so its joint is tried in a grid of turns (twists about the bone that leads to it and
/// tilts) with what hangs below straight, and as it stands in some other poses, then its fingers or toes one by one;
/// from the best ones a descent in these joints and, by a little, the one above (PartFit).
///
/// joint: of extremitiesOf; others: poses of frames nearby: joints are drawn to the median of these and rest, so that
/// what the scan does not show stays there. Returns whether `pose` was bettered; else, and when stopped, it is left as
/// it was. Throws InvalidInput naming an option.
bool seatExtremity(const ScanSurface& scan, const BodyModel& model, const Eigen::VectorXd& identity, std::int32_t joint,
                   std::span<const Pose> others, Pose& pose, const ExtremityOptions& options = {},
                   const std::stop_token& stop = {});

}  // namespace shaped
