#include "core/sample/creature_rig.h"

namespace shaped {

Rig rigOf(const SampleCreature& creature) {
  std::vector<Joint> joints;
  Vertices rest_joints(std::ssize(creature.bones), 3);
  for (const auto& bone : creature.bones) {
    rest_joints.row(std::ssize(joints)) = bone.joint;
    joints.push_back({bone.name, bone.parent});
  }
  // Shares that do not show make files large.
  const Eigen::MatrixXd shares = (creature.weights.array() < 1e-4).select(0.0, creature.weights);
  const SkinWeights weights = shares.sparseView();
  return {Skeleton(std::move(joints)), std::move(rest_joints), normaliseWeights(weights).weights, std::nullopt};
}

}  // namespace shaped
