#pragma once

#include <vector>

#include "core/bootstrap/bootstrap_report.h"

namespace shaped {

/// Judges a round that is over ([Mur25] Algorithm 2, lines 20 to 22): of the scans that are pending, those join whose
/// chamfer distance is at most the smallest of them plus `deviations` standard deviations (of these distances, over
/// their number); the others are too far. So at least the nearest joins. Fills in all but round and registrations.
void judge(double deviations, BootstrapRound& round);

}  // namespace shaped
