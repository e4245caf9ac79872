#pragma once

#include <span>

namespace shaped {

/// result[i] = log(x[i]). Vector instructions of the C library where it has them (glibc on x86-64), within 4 units in
/// the last place of the exact value; special values as std::log. All spans of one length; result may be x.
void logarithms(std::span<const double> x, std::span<double> result);

/// result[i] = atan2(y[i], x[i]) in (-pi, pi], as above.
void arcTangents(std::span<const double> y, std::span<const double> x, std::span<double> result);

}  // namespace shaped
