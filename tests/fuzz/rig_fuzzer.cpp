#include "core/io/rig_file.h"
#include "tests/fuzz/fuzz.h"

using namespace shaped;
using namespace shaped::fuzz;

namespace {

constexpr std::int32_t kVertices = 3;

void requireRig(const Rig& rig) {
  require(accepted<InvalidInput>([&] { return rig.requireValid(kVertices), true; }).has_value(), "the rig is valid");
}

}  // namespace

FUZZ_TARGET(rig) {
  const auto read = accepted<InvalidInput>([&] { return parseRig("rig.json", bytes, kVertices); });
  if (!read) return;
  const Rig& rig = read->rig;
  requireRig(rig);
  const auto file = scratchFolder() / "rig.json";
  writeRig(file, rig);
  const auto back = readRig(file, kVertices).rig;
  require(back.skeleton.jointCount() == rig.skeleton.jointCount(), "joints survive");
  for (std::int32_t j = 0; j < rig.skeleton.jointCount(); ++j)
    require(back.skeleton.name(j) == rig.skeleton.name(j) && back.skeleton.parent(j) == rig.skeleton.parent(j),
            "names and parents survive");
  require(back.rest_joints == rig.rest_joints, "rest positions survive");
  require((back.weights - rig.weights).norm() < 1e-12, "weights survive");
}
