#include "core/rendering/point_balls.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include "core/mesh/topology.h"

using namespace shaped;

TEST_CASE("points become closed outward octahedra around them") {
  Vertices points(2, 3);
  points << 1, 2, 3, -4, 5, 6;
  const auto balls = pointBalls(points, 0.1);
  const Topology topology(12, balls.faces);
  CHECK(topology.closed());
  CHECK(topology.componentCount() == 2);
  for (int i = 0; i < 2; ++i) {
    CHECK((balls.vertices.middleRows(6 * i, 6).colwise().mean() - points.row(i)).norm() < 1e-15);
    double volume = 0;
    for (int f = 8 * i; f < 8 * i + 8; ++f) {
      const auto corner = [&](int c) {
        return Eigen::RowVector3d(balls.vertices.row(balls.faces(f, c)) - points.row(i));
      };
      const double part = corner(0).dot(corner(1).cross(corner(2))) / 6;
      CHECK(part > 0);
      volume += part;
    }
    CHECK(volume == Approx(4.0 / 3 * 1e-3));
  }
  CHECK(touchingRadius(points) == Approx(0.4 * std::sqrt(43.0 / 2)));
  CHECK(touchingRadius(points.topRows(1)) == 1);
}
