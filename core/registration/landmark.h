#pragma once

#include "core/mesh/anchor.h"

namespace shaped {

/// A point of the template that is known on the scan.
struct Landmark {
  Anchor anchor;             ///< on the template
  Eigen::Vector3d position;  ///< on the scan, m
  double weight = 1;         ///< >= 0, of the squared distance
};

}  // namespace shaped
