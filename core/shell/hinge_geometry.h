#pragma once

#include <Eigen/Geometry>

#include "core/mesh/topology.h"

namespace shaped {

/// First derivatives of a hinge's angle, edge length and areas with respect to its four vertices.
///
/// With N the doubled area vector of a side and m_i = n x c_i for the edge c_i opposite vertex i (counter-clockwise):
///   dtheta/dx_i = sum over sides of alpha_i n / |N|,   d(area)/dx_i = -m_i / 2,
/// where alpha is (x1 - apex).e/|e|, (apex - x0).e/|e|, -|e| for x0, x1 and the apex.
struct HingeGeometry {
  struct Side {
    Eigen::Vector3d normal;              ///< unit
    double doubled_area;                 ///< |N|
    std::array<double, 4> alpha;         ///< per hinge vertex; 0 for the other side's apex
    std::array<Eigen::Vector3d, 4> m;    ///< per hinge vertex; 0 for the other side's apex
    Eigen::Vector3d height_direction;    ///< unit, from the edge towards the apex
  };
  std::array<Side, 2> sides;
  Eigen::Vector3d edge;  ///< x1 - x0
  double length;         ///< |edge|

  HingeGeometry(const Hinge& hinge, const Vertices& shape) {
    const auto& v = hinge.vertices;
    const Eigen::Vector3d x0 = shape.row(v[0]), x1 = shape.row(v[1]);
    edge = x1 - x0;
    length = edge.norm();
    const Eigen::Vector3d direction = edge / length;
    const double orientation[2] = {1, -1};
    for (std::size_t s = 0; s < 2; ++s) {
      auto& side = sides[s];
      const std::size_t apex = 2 + s, other = 3 - s;
      const Eigen::Vector3d xk = shape.row(v[apex]);
      const Eigen::Vector3d to_apex = xk - x0, from_apex = x1 - xk;
      const Eigen::Vector3d area_vector = orientation[s] * edge.cross(to_apex);
      side.doubled_area = area_vector.norm();
      side.normal = area_vector / side.doubled_area;
      const double along = to_apex.dot(direction);
      side.alpha[0] = length - along;
      side.alpha[1] = along;
      side.alpha[apex] = -length;
      side.alpha[other] = 0;
      const Eigen::Vector3d turned = orientation[s] * side.normal;
      side.m[0] = turned.cross(from_apex);
      side.m[1] = turned.cross(to_apex);
      side.m[apex] = -turned.cross(edge);
      side.m[other].setZero();
      side.height_direction = -side.m[apex] / length;
    }
  }

  Eigen::Vector3d angleGradient(std::size_t i) const {
    Eigen::Vector3d result = Eigen::Vector3d::Zero();
    for (const auto& side : sides) result += (side.alpha[i] / side.doubled_area) * side.normal;
    return result;
  }
  /// Of the sum of both areas.
  Eigen::Vector3d areaGradient(std::size_t i) const { return -0.5 * (sides[0].m[i] + sides[1].m[i]); }
  /// Of the squared edge length.
  Eigen::Vector3d lengthGradient(std::size_t i) const {
    if (i > 1) return Eigen::Vector3d::Zero();
    return i == 1 ? Eigen::Vector3d(2 * edge) : Eigen::Vector3d(-2 * edge);
  }

  /// d2theta/dx_i dx_j = sum over sides of (alpha_j n m_i^T + alpha_i m_j n^T) / |N|^2, and on the edge's own vertices
  /// +-(n h^T + h n^T) / (2 |e|^2) with the unit height h.
  Eigen::Matrix3d angleHessian(std::size_t i, std::size_t j) const {
    Eigen::Matrix3d result = Eigen::Matrix3d::Zero();
    for (const auto& side : sides) {
      const double scale = 1 / (side.doubled_area * side.doubled_area);
      result += (scale * side.alpha[j]) * side.normal * side.m[i].transpose();
      result += (scale * side.alpha[i]) * side.m[j] * side.normal.transpose();
      if (i < 2 && j < 2) {
        const double sign = (i == j ? 0.5 : -0.5) / (length * length);
        result += sign * (side.normal * side.height_direction.transpose());
        result += sign * (side.height_direction * side.normal.transpose());
      }
    }
    return result;
  }
};

}  // namespace shaped
