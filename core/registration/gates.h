#pragma once

#include <optional>
#include <string>

#include "core/registration/scan_surface.h"

namespace shaped {

/// Which closest points count as correspondences (Allen, Curless, Popovic 2003, section 3.1: a pair is left out when
/// its normals differ too much or the scan point lies on a boundary).
struct CorrespondenceGates {
  double max_distance = 0.1;     ///< m, > 0
  double max_normal_angle = 60;  ///< degrees between the normals, (0, 180]; their lines where the scan's are unoriented
  bool reject_boundary = true;   ///< leaves out closest points at the scan's boundary: what lies beyond is not seen
  std::optional<std::string> firstViolation() const;  ///< "max_distance = 0, want > 0"
};

/// Whether two unit normals (zero: unknown, which agrees) pass the gate; unoriented ones as lines.
bool normalsAgree(const CorrespondenceGates& gates, bool oriented, const Eigen::RowVector3d& one,
                  const Eigen::RowVector3d& other);

/// How much a large residual r counts: rho(r^2), which grows as r^2 near 0 and stays below scale^2. Its minimum is
/// found by least squares with weights rho'(r^2), renewed after each solve (Holland and Welsch 1977).
struct RobustLoss {
  enum class Kind {
    kSquares,       ///< r^2
    kGemanMcClure,  ///< s^2 r^2 / (s^2 + r^2)  [Geman and McClure 1987]
    kWelsch         ///< s^2 (1 - exp(-r^2 / s^2))  [Dennis and Welsch 1978]
  };
  Kind kind = Kind::kGemanMcClure;
  double scale = 0.01;  ///< s, m, > 0

  double value(double squared_residual) const;   ///< rho, m^2
  double weight(double squared_residual) const;  ///< d rho / d (r^2), in [0, 1]
};

/// Where each vertex of a template is pulled, and how strongly.
struct Correspondences {
  Vertices targets;           ///< V x 3: the closest scan point, also where it is not accepted
  Vertices normals;           ///< V x 3: the scan's there, unit or zero
  Eigen::VectorXd accepted;   ///< V values, 1 or 0: passed the gates
  Eigen::VectorXd distances;  ///< V values, m: to `targets`
  Eigen::Index too_far = 0, wrong_normal = 0, at_boundary = 0;  ///< left out, each counted under the first cause

  Eigen::Index acceptedCount() const { return accepted.size() - too_far - wrong_normal - at_boundary; }
};

/// The closest scan point of each vertex (V x 3) and what the gates say; normals: V x 3, unit, of the template at the
/// vertices (zero passes the normal gate). Throws InvalidInput when a gate is out of range or the sizes differ.
Correspondences findCorrespondences(const ScanSurface& scan, const Vertices& vertices, const Vertices& normals,
                                    const CorrespondenceGates& gates);

}  // namespace shaped
