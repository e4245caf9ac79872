#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/mesh/alignment.h"
#include "core/mesh/scan.h"
#include "core/sample/scan_gaps.h"
#include "core/sample/surface_sampler.h"

namespace shaped {

/// A scanner of many cameras around a body, as body scanners are built. The defaults are of one that sees about 95 % of
/// a standing person.
struct VirtualScannerOptions {
  int cameras = 8;                ///< on a ring around the mesh's middle, 1 to 1000
  double ring_radius = 2.8;       ///< m, > 0
  double below = 0.25;            ///< m: every other camera, from the first, is that far below the middle, ...
  double above = 0.65;            ///< m: ... the others that far above
  double smallest_cosine = 0.33;  ///< between a face's normal and the way to a camera that sees it, 0 to 1

  int points = 20000;         ///< of a scan without gaps, outliers among them; 1 to 1000000
  double noise = 0.0015;      ///< standard deviation along the viewing ray, m, >= 0
  double normal_noise = 5;    ///< standard deviation of the normals' tilt in each tangent direction, degrees, 0 to 90
  double outliers = 0.005;    ///< share of the points, 0 to 0.9
  double outlier_box = 0.15;  ///< m around the mesh's bounding box, >= 0: outliers lie evenly in there

  double holes = 0;           ///< share of the seen points that balls take away; with `cut` 0 to 0.9
  double hole_radius = 0.08;  ///< m, > 0; each ball has 0.5 to 1.5 times this
  double cut = 0;             ///< share of the seen points that a half-space takes away

  /// Where the body stands in the scanner's frame; at random where not given.
  std::optional<RigidMotion> motion;
  bool any_rotation = false;  ///< of a random motion: evenly over all rotations, not any yaw and then a tilt
  double largest_tilt = 20;   ///< degrees, evenly from 0, about a random level axis, 0 to 180
  double largest_shift = 1;   ///< m, evenly along each axis, >= 0
  std::uint64_t seed = 1;

  std::optional<std::string> firstViolation() const;  ///< "points = 0, want 1 to 1000000"
};

/// The default scanner, made for a person of 2 m (the diagonal of the bounding box), for things of `extent` m: all its
/// lengths in proportion, so that a face is scanned from half a metre with a third of a millimetre of noise.
VirtualScannerOptions scannerFor(double extent);

/// What a point of the scan saw: of an outlier nothing.
struct ScannedPoint {
  SurfaceSample place{-1, Eigen::RowVector3d::Zero()};  ///< on the mesh; face -1 for an outlier
  int camera = -1;
};

struct VirtualScan {
  Scan scan;                           ///< points and normals, no faces, in the scanner's frame
  RigidMotion motion;                  ///< scan = R x + t, x in the mesh's frame
  std::vector<Eigen::Index> outliers;  ///< ascending
  double visible_fraction;             ///< share of the mesh's area that some camera sees, gaps not counted (estimated)
  std::vector<ScannedPoint> truth;     ///< N
  std::vector<ScanHole> holes;         ///< in the mesh's frame
  std::optional<ScanCut> cut;          ///< in the mesh's frame
};

/// The cameras, K x 3 in the mesh's frame: even azimuths from +z towards +x around the middle of the bounding box.
Vertices cameraPositions(const Vertices& vertices, const VirtualScannerOptions& options = {});

/// Scans a mesh: points evenly by area, each kept where at least one camera sees it (turned towards it by
/// smallest_cosine, nothing between), moved by noise along the ray of one of those cameras, drawn in proportion to the
/// cosine as their pixels cover the surface; its normal is that of the smooth surface (interpolated vertex normals),
/// tilted by noise. Then gaps, outliers at random places with random normals, and the motion.
///
/// vertices: V x 3, metres, y up; faces: F x 3, outward; a closed mesh within the ring. The same input gives the same
/// scan; every point has a random sequence of its own, so on another machine, where the ray caster's floats round
/// otherwise, no more than a point at the very edge of a shadow may be another. Throws InvalidInput for options out of
/// range, for a mesh as SurfaceSampler does, and naming `vertices` when the cameras see less than a thousandth of it.
VirtualScan scanVirtually(const Vertices& vertices, const Faces& faces, const VirtualScannerOptions& options = {});

}  // namespace shaped
