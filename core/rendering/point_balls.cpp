#include "core/rendering/point_balls.h"

#include <cmath>

#include "core/mesh/quality.h"

namespace shaped {

PointBalls pointBalls(const Vertices& points, double radius) {
  Eigen::Matrix<double, 6, 3> corners;
  corners << 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1;
  Eigen::Matrix<std::int32_t, 8, 3> sides;
  sides << 0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5;
  PointBalls balls{Vertices(6 * points.rows(), 3), Faces(8 * points.rows(), 3)};
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    balls.vertices.middleRows<6>(6 * i) = (radius * corners).rowwise() + points.row(i);
    balls.faces.middleRows<8>(8 * i) = sides.array() + static_cast<std::int32_t>(6 * i);
  }
  return balls;
}

double touchingRadius(const Vertices& points) {
  const double diagonal = boundingBoxDiagonal(points);
  return diagonal > 0 ? 0.4 * diagonal / std::sqrt(static_cast<double>(points.rows())) : 1;
}

}  // namespace shaped
