#pragma once

#include <Eigen/Core>

#include "core/mesh/types.h"

namespace shaped {

/// Area of each triangle, F values, square metres.
Eigen::VectorXd triangleAreas(const Faces& faces, const Vertices& vertices);

/// Quality of each triangle, F values: 4 sqrt(3) area / (sum of squared edge lengths). 1 for an equilateral triangle, 0
/// for one without area (also for one whose corners coincide).
Eigen::VectorXd triangleQualities(const Faces& faces, const Vertices& vertices);

/// Areas of one shape's triangles, to compare many others to.
class ReferenceAreas {
 public:
  /// faces: must outlive it. The reference's triangles must have area (requireValidShape).
  ReferenceAreas(const Faces& faces, const Vertices& reference);
  /// The smallest of area(shape) / area(reference) over the triangles: 0 when a triangle collapsed. Throws InvalidInput
  /// when the two have different vertex counts.
  double smallestRatio(const Vertices& shape) const;

 private:
  const Faces& faces_;
  Eigen::Index vertex_count_;
  Eigen::VectorXd inverse_squares_;  ///< of twice the areas [1/m^4]
};

/// ReferenceAreas(faces, reference).smallestRatio(shape).
double smallestAreaRatio(const Faces& faces, const Vertices& reference, const Vertices& shape);

/// Unit normal of each triangle, F x 3, pointing to the side that sees it counter-clockwise; zero where there is no
/// area.
Vertices faceNormals(const Faces& faces, const Vertices& vertices);

/// Unit normal of each vertex, V x 3: the area-weighted mean over its triangles; zero where that vanishes.
Vertices vertexNormals(const Faces& faces, const Vertices& vertices);

/// Length of the diagonal of the axis-aligned bounding box, metres; 0 without vertices.
double boundingBoxDiagonal(const Vertices& vertices);
/// Largest distance between two vertices, metres; 0 without vertices. Unlike the box it does not change with the pose
/// in space.
double diameter(const Vertices& vertices);

/// Distances between corresponding vertices of two shapes, metres, as they stand (no alignment).
/// Throw InvalidInput when the shapes have different vertex counts or none at all.
double meanVertexDistance(const Vertices& one, const Vertices& two);
double rmsVertexDistance(const Vertices& one, const Vertices& two);
double maxVertexDistance(const Vertices& one, const Vertices& two);

}  // namespace shaped
