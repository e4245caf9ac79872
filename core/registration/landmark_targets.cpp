#include "core/registration/landmark_targets.h"

#include "core/numerics/error.h"

namespace shaped {

std::vector<SurfaceTarget> landmarkTargets(const std::vector<Landmark>& landmarks, const Faces& faces, double weight) {
  std::vector<SurfaceTarget> targets;
  double sum = 0;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const auto& landmark = landmarks[i];
    const std::string where = "landmarks[" + std::to_string(i) + "]";
    if (landmark.anchor.face < 0 || landmark.anchor.face >= faces.rows())
      throw InvalidInput(where, "is on face " + std::to_string(landmark.anchor.face) + ", and the model has " +
                                    std::to_string(faces.rows()));
    if (!landmark.position.allFinite() || !(landmark.weight >= 0)) throw InvalidInput(where, "is not finite");
    SurfaceTarget target;
    for (int c = 0; c < 3; ++c) target.corners[std::size_t(c)] = faces(landmark.anchor.face, c);
    target.barycentric = landmark.anchor.barycentric;
    target.position = landmark.position;
    target.weight = landmark.weight;
    sum += landmark.weight;
    targets.push_back(target);
  }
  for (auto& target : targets) target.weight *= sum > 0 ? weight / sum : 0;
  return targets;
}

}  // namespace shaped
