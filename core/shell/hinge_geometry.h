#pragma once

#include <Eigen/Geometry>
#include <array>

#include "core/mesh/topology.h"

namespace shaped {

/// First derivatives of a hinge's angle, edge length and areas with respect to its four vertices.
///
/// Side s has the doubled area vector N_s = n_s |N_s| and the apex x_{2+s}. With the unit edge vector e / |e|, e = x1 -
/// x0,
///   d(angle)/dx_i = sum over sides of alpha_i N / |N|^2,
///   alpha = (x1 - apex).e/|e|, (apex - x0).e/|e|, -|e| for x0, x1 and the side's own apex.
class HingeGeometry {
 public:
  using Gradient = std::array<Eigen::Vector3d, 4>;  ///< one vector per hinge vertex

  HingeGeometry(const Hinge& hinge, const Vertices& shape) {
    const auto& v = hinge.vertices;
    const Eigen::Vector3d x0 = shape.row(v[0]);
    edge_ = shape.row(v[1]).transpose() - x0;
    to_apex_ = {shape.row(v[2]).transpose() - x0, shape.row(v[3]).transpose() - x0};
    N_ = {edge_.cross(to_apex_[0]), to_apex_[1].cross(edge_)};
  }

  Gradient angleGradient() const {
    const double length = edge_.norm(), inverse = 1 / length;
    const Eigen::Vector3d first = N_[0] / N_[0].squaredNorm(), second = N_[1] / N_[1].squaredNorm();
    const double along[2] = {inverse * to_apex_[0].dot(edge_), inverse * to_apex_[1].dot(edge_)};
    return {(length - along[0]) * first + (length - along[1]) * second, along[0] * first + along[1] * second,
            -length * first, -length * second};
  }

  /// Of the sum of both areas: n x (edge opposite the vertex, counter-clockwise) / 2 per side.
  Gradient areaGradient() const {
    const Eigen::Vector3d first = N_[0].normalized() / 2, second = N_[1].normalized() / 2;
    const Eigen::Vector3d at_x1 = to_apex_[0].cross(first) - to_apex_[1].cross(second);
    const Eigen::Vector3d at_x2 = first.cross(edge_), at_x3 = edge_.cross(second);
    return {-(at_x1 + at_x2 + at_x3), at_x1, at_x2, at_x3};
  }

  /// Of the squared edge length.
  Gradient lengthGradient() const { return {-2 * edge_, 2 * edge_, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()}; }

 private:
  Eigen::Vector3d edge_;
  std::array<Eigen::Vector3d, 2> to_apex_, N_;
};

}  // namespace shaped
