#pragma once

#include "core/skeleton/rig.h"

namespace shaped {

/// The joint that carries a vertex foremost; of equals the first.
inline std::int32_t foremostJoint(const SkinWeights& weights, Eigen::Index vertex) {
  std::int32_t joint = 0;
  double most = -1;
  for (SkinWeights::InnerIterator entry(weights, vertex); entry; ++entry)
    if (entry.value() > most) most = entry.value(), joint = std::int32_t(entry.col());
  return joint;
}

}  // namespace shaped
