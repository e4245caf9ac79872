#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/io/motion_channel.h"
#include "core/io/text_scanner.h"

namespace shaped {

/// One ROOT or JOINT of a BVH file.
struct BvhJoint {
  std::string name;
  std::int32_t parent;        ///< -1 for the root
  Eigen::RowVector3d offset;  ///< from the parent, in the file's unit
  std::vector<MotionChannel> channels;
};

/// Reads from HIERARCHY to the line MOTION, where the scanner then stands; parents come before children.
/// Fails at the scanner's line when the format is broken.
std::vector<BvhJoint> readBvhHierarchy(TextScanner& scanner);

}  // namespace shaped
