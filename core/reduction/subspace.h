#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/mesh/types.h"

namespace shaped {

/// An affine space of shapes: the origin plus combinations of directions.
struct ShapeSubspace {
  Vertices origin;        ///< V x 3
  Eigen::MatrixXd basis;  ///< 3V x d, orthonormal columns, coordinates vertex by vertex

  Eigen::Index dimension() const { return basis.cols(); }
  Vertices shape(const Eigen::VectorXd& coordinates) const;
  /// Of the shape's point nearest in the space.
  Eigen::VectorXd coordinates(const Vertices& shape) const;
  /// Adds what is new in a direction (3V); false when that is less than 1e-9 of it, and nothing was added.
  bool append(const Eigen::VectorXd& direction);
};

/// Orthonormal infinitesimal rigid motions of a shape, 3V x 6: what an energy cannot see.
Eigen::MatrixXd infinitesimalRigidMotions(const Vertices& shape);

/// The `dimension` directions in which the shapes differ most from the origin: the left singular vectors of their
/// displacements with the largest singular values ([BvTH16] section 6). Fewer where the others are below `negligible`
/// times the largest. The shapes should be aligned to the origin.
ShapeSubspace principalSubspace(const Vertices& origin, const std::vector<Vertices>& shapes, int dimension,
                                double negligible = 1e-9);

/// The subspace and one direction more, with which it contains the shape: [BvTH16]'s missing vector. As it is when it
/// contains the shape already (to 1e-9 of its displacement).
ShapeSubspace including(const ShapeSubspace& subspace, const Vertices& shape);

/// The shape that is nearest to the mean of all, once each is aligned to the first: a good origin.
std::size_t centralShape(const std::vector<Vertices>& shapes);

}  // namespace shaped
