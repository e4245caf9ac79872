#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace shaped {

/// Where markers sit on a template: each at a vertex, or at a point of a face, and maybe off the skin.
struct MarkerSet {
  struct Marker {
    std::string label;                                      ///< without a subject's name: "LFWT"
    std::int32_t vertex = -1;                               ///< >= 0: at this vertex; -1: at a point of `face`
    std::int32_t face = -1;                                 ///< >= 0 when vertex is -1
    Eigen::Vector3d barycentric = Eigen::Vector3d::Zero();  ///< of the point in `face`: >= 0, sums to 1
    /// From the skin to the marker's centre, metres, in the axes of the template shape; it turns with the surface.
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  };
  std::vector<Marker> markers;
};

}  // namespace shaped
