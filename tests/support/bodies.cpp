#include "tests/support/bodies.h"

namespace shaped::test {

PostureTemplate tubeTemplate(int joints) {
  const auto tube = riggedTube(joints);
  return makePostureTemplate(tube.mesh.topology, tube.mesh.vertices, tube.rig);
}

std::vector<Vertices> tubeIdentities(const PostureTemplate& reference, int count, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<Vertices> shapes;
  for (int i = 0; i < count; ++i) {
    const double length = 1 + 0.08 * normal(random), girth = 1 + 0.15 * normal(random), taper = 0.1 * normal(random),
                 belly = 0.1 * normal(random);
    Vertices shape = reference.rest;
    for (Eigen::Index v = 0; v < shape.rows(); ++v) {
      const double x = shape(v, 0);
      shape(v, 0) *= length;
      shape.row(v).tail<2>() *= girth + taper * x / 2 + belly * std::exp(-4 * x * x);
    }
    shapes.push_back(std::move(shape));
  }
  return shapes;
}

BodyModel tubeModel(int joints, int count, int modes) {
  const auto reference = tubeTemplate(joints);
  BodyTrainingOptions options;
  options.modes = modes;
  options.posture = PostureNormalisation::kNone;
  return trainBody(reference, tubeIdentities(reference, count, 5), options)->model;
}

Eigen::VectorXd randomIdentity(const BodyModel& model, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Eigen::VectorXd identity(model.modeCount());
  for (auto& number : identity) number = normal(random);
  return identity;
}

}  // namespace shaped::test
