#include "core/curve/travel.h"

namespace shaped {

Travel::Travel(const std::vector<RigidMotion>& stops, const Eigen::Vector3d& centre) : centre_(centre) {
  for (const auto& stop : stops) {
    turns_.emplace_back(stop.rotation);
    places_.emplace_back(stop.rotation * centre + stop.translation);
  }
}

RigidMotion Travel::at(double share) const {
  auto turns = turns_;
  auto places = places_;
  for (std::size_t count = turns.size(); count > 1; --count)
    for (std::size_t i = 0; i + 1 < count; ++i) {
      turns[i] = turns[i].slerp(share, turns[i + 1]);
      places[i] = (1 - share) * places[i] + share * places[i + 1];
    }
  const Eigen::Matrix3d rotation = turns.front().toRotationMatrix();
  return {rotation, places.front() - rotation * centre_};
}

}  // namespace shaped
