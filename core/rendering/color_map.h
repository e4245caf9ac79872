#pragma once

#include "core/mesh/types.h"
#include "core/rendering/image.h"

namespace shaped {

/// The colour of an error: pale at 0, through yellow and red, to dark violet at 1 and above; luminance falls all the
/// way, so it also reads in grey. NaN gives mid-grey.
Color errorColor(double fraction);

/// Colours of values, V x 3 in [0, 1]: errorColor(value / limit). limit > 0, in the unit of the values. Throws
/// InvalidInput when the limit is not positive.
Vertices errorColors(const Eigen::VectorXd& values, double limit);

/// A round number (1, 2 or 5 times a power of ten) at or above the value; 1 for values that are not positive.
double roundedLimit(double value);

}  // namespace shaped
