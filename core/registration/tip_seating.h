#pragma once

#include <array>

#include "core/registration/part_fit.h"

namespace shaped {

/// Coarser than of a part that is all there is to fit: many tips are tried in many places.
PartFitOptions tipFitDefaults();

struct TipOptions {
  /// How far parts reach (jointReach) that are seated one kind after the other, m, each >= 0 (0: none): hands and feet,
  /// then fingers and toes. A hand turned in the wrist has all fingers one place off, and no finger alone finds back.
  std::array<double, 2> reaches = {0.22, 0.12};
  double tilt = 12;         ///< degrees, as from a finger to the next, (0, 180]
  double least_gain = 0.1;  ///< what another place must save to be taken, in the measure of PartFit::cost, >= 0
  PartFitOptions fit = tipFitDefaults();  ///< of a tip's joints, about rest

  std::optional<std::string> firstViolation() const;  ///< "tilt = 0, want (0, 180] degrees"
};

/// The joints at which small parts at the ends of limbs begin, as fingers and toes: those that reach no further than
/// largest_reach, below one that does.
std::vector<std::int32_t> tipsOf(const BodyModel& model, double largest_reach);

/// Seats hands, feet, fingers and toes that a descent may have left in their neighbours' places, where each finger is a
/// good fit but for the outermost: each such tip descends (PartFit) from where it stands, from there tilted to all
/// sides, and with its joints at rest. The rest of the body is held, but that the joint above a tip gives way by a
/// little.
///
/// Returns how many tips have another place in `pose`. Once the token has fired, those not tried stay. Throws
/// InvalidInput naming an option.
int seatTips(const ScanSurface& scan, const BodyModel& model, const Eigen::VectorXd& identity, Pose& pose,
             const TipOptions& options = {}, const std::stop_token& stop = {});

}  // namespace shaped
