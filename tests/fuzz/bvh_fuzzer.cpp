#include "core/io/bvh.h"
#include "tests/fuzz/fuzz.h"

using namespace shaped;
using namespace shaped::fuzz;

namespace {

void requireClip(const MotionClip& clip) {
  require(!clip.frames.empty() && clip.rate_hz > 0, "there are frames at a rate");
  require(clip.rest_joints.rows() == clip.skeleton.jointCount() && clip.rest_joints.allFinite(), "joints are finite");
  for (const auto& pose : clip.frames) {
    require(pose.rotations.rows() == clip.skeleton.jointCount() && pose.rotations.allFinite(), "rotations are finite");
    require(pose.translation.allFinite(), "translations are finite");
  }
}

/// Files with names or numbers at the edge of what doubles hold need not survive.
void requireRoundTrip(const MotionClip& clip) {
  if (clip.rest_joints.cwiseAbs().maxCoeff() > 1e6) return;
  const auto file = scratchFolder() / "motion.bvh";
  if (!accepted<InvalidInput>([&] { return writeBvh(file, clip, 1), true; })) return;
  const auto back = readBvh(file, 1);
  require(back.frames.size() == clip.frames.size(), "frames survive");
  require(back.skeleton.jointCount() == clip.skeleton.jointCount(), "joints survive");
  for (std::int32_t j = 0; j < clip.skeleton.jointCount(); ++j)
    require(back.skeleton.find(clip.skeleton.name(j)).has_value(), "names survive");
}

}  // namespace

FUZZ_TARGET(bvh) {
  const auto clip = accepted<InvalidInput>([&] { return parseBvh("motion.bvh", bytes, 1); });
  if (!clip) return;
  requireClip(*clip);
  requireRoundTrip(*clip);
}
