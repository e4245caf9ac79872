#include "core/io/asf.h"
#include "tests/fuzz/fuzz.h"

using namespace shaped;
using namespace shaped::fuzz;

FUZZ_TARGET(asf) {
  const auto read = accepted<InvalidInput>([&] { return parseAsf("skeleton.asf", bytes); });
  if (!read) return;
  const auto count = read->skeleton.jointCount();
  require(read->rest_joints.rows() == count && read->bone_ends.rows() == count, "each joint has its place");
  require(read->bones.size() == static_cast<std::size_t>(count), "each joint has its bone");
  require(read->rest_joints.allFinite() && read->bone_ends.allFinite(), "joints are finite");
  require(read->metres_per_unit > 0, "the unit is above 0");
  for (const auto& bone : read->bones) {
    require((bone.axes * bone.axes.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-9, "axes are orthonormal");
    for (const auto& channel : bone.channels) require(channel.axis >= 0 && channel.axis < 3, "axes are x, y, z");
  }
}
