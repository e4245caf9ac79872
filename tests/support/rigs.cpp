#include "tests/support/rigs.h"

#include <cmath>

namespace shaped::test {

RiggedTube riggedTube(int joints) {
  Mesh mesh = tube(24, 12);
  const double left = mesh.vertices.col(0).minCoeff(), length = mesh.vertices.col(0).maxCoeff() - left;
  std::vector<Joint> names;
  for (int j = 0; j < joints; ++j) names.push_back({"bone" + std::to_string(j), j - 1});
  names.push_back({"up", joints - 1});
  names.push_back({"down", joints - 1});
  Rig rig{Skeleton(names), Vertices::Zero(joints + 2, 3), {}, std::nullopt};
  const double spacing = length / (joints + 1);
  for (int j = 0; j < joints + 2; ++j) rig.rest_joints(j, 0) = left + spacing * std::min(j + 0.5, joints + 0.3);
  rig.rest_joints(joints, 1) = 0.2;
  rig.rest_joints(joints + 1, 1) = -0.2;
  std::vector<Eigen::Triplet<double>> raw;
  for (int v = 0; v < mesh.vertices.rows(); ++v)
    for (int j = 0; j < joints + 2; ++j) {
      const double bone_middle = rig.rest_joints(j, 0) + spacing / 2;
      const double side = j < joints ? 1 : std::max(0.0, 0.5 + (j == joints ? 1 : -1) * mesh.vertices(v, 1));
      const double reach = 1 - std::abs(mesh.vertices(v, 0) - bone_middle) / (1.2 * spacing);
      if (reach * side > 0 || j == std::clamp(int((mesh.vertices(v, 0) - left) / spacing - 0.5), 0, joints - 1))
        raw.emplace_back(v, j, std::max(reach, 0.05) * side);
    }
  SkinWeights weights(mesh.vertices.rows(), joints + 2);
  weights.setFromTriplets(raw.begin(), raw.end());
  rig.weights = normaliseWeights(weights).weights;
  return {mesh, rig};
}

Pose randomPose(const Skeleton& skeleton, double angle, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-angle / std::sqrt(3.0), angle / std::sqrt(3.0));
  Pose pose = restPose(skeleton);
  for (auto& number : pose.rotations.reshaped()) number = uniform(random);
  for (auto& number : pose.translation) number = uniform(random);
  return pose;
}

}  // namespace shaped::test
