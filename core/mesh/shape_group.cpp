#include "core/mesh/shape_group.h"

namespace shaped {

ShapeGroup::ShapeGroup(const std::vector<Vertices>& shapes)
    : coordinates_(static_cast<Eigen::Index>(shapes.size()), 3 * shapes.front().rows()) {
  for (std::size_t s = 0; s < shapes.size(); ++s) {
    const Vertices centred = shapes[s].rowwise() - shapes[s].colwise().mean();
    coordinates_.row(static_cast<Eigen::Index>(s)) =
        Eigen::Map<const Eigen::RowVectorXd>(centred.data(), centred.size()).array();
  }
}

}  // namespace shaped
