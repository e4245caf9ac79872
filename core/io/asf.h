#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/io/motion_channel.h"
#include "core/mesh/types.h"
#include "core/skeleton/skeleton.h"

namespace shaped {

/// How motion files in Acclaim's format speak of a bone: numbers along and about axes of its own.
struct AcclaimBone {
  Eigen::Matrix3d axes;  ///< C, whose columns are the bone's own axes in the world's
  std::vector<MotionChannel>
      channels;  ///< in the order of the numbers; turns follow each other, the first one innermost
};

/// A skeleton in Acclaim's format. Joint 0 is the root and the others are the bones, each joint where its bone begins:
/// joint j turns bone j and what hangs on it. A bone's end is where its children begin.
struct AcclaimSkeleton {
  Skeleton skeleton;
  Vertices rest_joints;            ///< J x 3, m; the root at the origin
  Vertices bone_ends;              ///< J x 3, m: where each bone ends at rest; the root's row is the root itself
  std::vector<AcclaimBone> bones;  ///< J
  double metres_per_unit;          ///< of the lengths in this file and its motions: an inch by `length` of :units
  double radians_per_unit;         ///< of the angles: `angle` of :units, deg or rad
};

/// Reads an ASF skeleton (Acclaim; M. Meredith, S. Maddock, "Motion Capture File Formats Explained", 2001). A bone's
/// rotation R is about its own axes, C = the product of the turns that `axis` names, the first one innermost; in frames
/// aligned with the world's axes at rest it is C R C^T. Joints come depth first, children in the order of the file.
/// `limits` are of the Euler angles about a bone's own axes, which box no axis-angle vector: they are skipped, as are
/// masses and :skin.
///
/// Throws InvalidInput naming the file and line when the file cannot be opened, breaks the format, a number is not
/// finite or not in range, a name occurs twice or is unknown, a bone hangs on nothing or on two, a bone can be shifted
/// or stretched, or the root rests anywhere but at the origin, unturned.
AcclaimSkeleton readAsf(const std::filesystem::path& path);

/// The same from text; file: its name for error texts.
AcclaimSkeleton parseAsf(const std::string& file, std::string_view text);

}  // namespace shaped
