#pragma once

#include <optional>
#include <string>

#include "core/mesh/scan.h"

namespace shaped {

/// Fewest points that a scan needs to place a template on it.
inline constexpr Eigen::Index kFewestScanPoints = 100;

/// Throws InvalidInput naming `field` and the index when the scan has fewer than kFewestScanPoints points, a coordinate
/// or normal that is not finite, as many normals as neither points nor none, a face with a vertex out of range, or
/// points that all lie in one place.
void requireUsableScan(const Scan& scan, const std::string& field);

/// How far a point set reaches, whatever its placement and a few stray points: twice the 95th percentile of the
/// distances to the coordinates' medians. 0 without points.
double robustExtent(const Vertices& points);

/// What the scan has to be multiplied with to come into the template's unit, where its extent is off by about 10, 100
/// or 1000 or their inverse: millimetres, centimetres or decimetres taken for metres. Nothing where the two agree
/// within a factor of 3. A suspicion for the caller to report; nothing is scaled. template_extent: robustExtent of the
/// template, > 0 (InvalidInput).
std::optional<double> suspectedUnitFactor(const Scan& scan, double template_extent);

}  // namespace shaped
