#include "core/surface/nearest_anchor.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <limits>

#include "core/numerics/error.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;

TEST_CASE("the nearest anchor lies at its point, on the triangle below it") {
  const auto mesh = icosphere(2);
  const auto& faces = mesh.topology->faces();
  for (std::int32_t face = 0; face < faces.rows(); face += 13) {
    const Eigen::Vector3d centre =
        (mesh.vertices.row(faces(face, 0)) + mesh.vertices.row(faces(face, 1)) + mesh.vertices.row(faces(face, 2))) / 3;
    const auto anchor = nearestAnchor(*mesh.topology, mesh.vertices, 1.2 * centre);
    CHECK(anchor.face == face);
    CHECK((position(anchor, faces, mesh.vertices) - 1.2 * centre).norm() < 1e-14);
  }
}

TEST_CASE("a normal hint chooses the sheet that faces it") {
  const auto mesh = grid(5);
  const auto sheet = mesh.topology->faces().rows();
  Vertices both(50, 3);
  both << mesh.vertices, mesh.vertices;
  both.bottomRows(25).col(2).setConstant(0.1);
  Faces faces(2 * sheet, 3);
  faces << mesh.topology->faces(), mesh.topology->faces().rowwise().reverse().array() + 25;  // looks down
  const Topology topology(50, faces);
  const Eigen::Vector3d point(0.4, 0.3, 0.06);
  CHECK(nearestAnchor(topology, both, point).face >= sheet);
  CHECK(nearestAnchor(topology, both, point, Eigen::Vector3d(0, 0.1, 1)).face < sheet);
  CHECK(nearestAnchor(topology, both, point, Eigen::Vector3d(0, 0, -2)).face >= sheet);
  CHECK(nearestAnchor(topology, both, point, Eigen::Vector3d(1, 0, 0)).face >= sheet);  // nobody faces it: no hint
}

TEST_CASE("the nearest anchor refuses what it cannot read") {
  const auto mesh = icosphere(1);
  const Eigen::Vector3d nowhere = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  CHECK_THROWS_WITH(nearestAnchor(*mesh.topology, mesh.vertices, nowhere), Catch::Contains("point"));
  CHECK_THROWS_WITH(nearestAnchor(*mesh.topology, mesh.vertices.topRows(3), Eigen::Vector3d::Zero()),
                    Catch::Contains("vertices: has 3 rows"));
  CHECK_THROWS_WITH(nearestAnchor(*mesh.topology, Vertices::Zero(42, 3), Eigen::Vector3d::Zero()),
                    Catch::Contains("no triangle with area"));
}
