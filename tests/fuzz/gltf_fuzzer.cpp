#include "core/scene/gltf.h"
#include "tests/fuzz/fuzz.h"

using namespace shaped;
using namespace shaped::fuzz;

namespace {

void requireClip(const GltfRig& read, const GltfAnimation& animation) {
  require(!animation.clip.frames.empty(), "there are frames");
  for (const auto& pose : animation.clip.frames) {
    require(pose.rotations.rows() == read.rig.skeleton.jointCount() && pose.rotations.allFinite(),
            "rotations are finite");
    require(pose.translation.allFinite(), "translations are finite");
  }
}

}  // namespace

FUZZ_TARGET(gltf) {
  const auto file = scratchFile("character.glb", bytes);
  const auto read = accepted<InvalidInput>([&] { return readGltfRig(file); });
  if (!read) return;
  const auto vertices = static_cast<std::int32_t>(read->vertices.rows());
  require(vertices > 0 && read->vertices.allFinite(), "vertices are finite");
  require(read->faces.rows() > 0, "there are faces");
  require(read->faces.minCoeff() >= 0 && read->faces.maxCoeff() < vertices, "faces name vertices");
  require(accepted<InvalidInput>([&] { return read->rig.requireValid(vertices), true; }).has_value(),
          "the rig is valid");
  for (const auto& animation : read->animations) requireClip(*read, animation);
}
