#include "core/mesh/anchor.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include "core/numerics/error.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;

namespace {

Eigen::Matrix<double, 3, 9> differences(const Anchor& anchor, const Faces& faces, const Vertices& vertices) {
  Eigen::Matrix<double, 3, 9> result;
  const double step = 1e-6;
  for (int column = 0; column < 9; ++column) {
    Vertices up = vertices, down = vertices;
    up(faces(anchor.face, column / 3), column % 3) += step;
    down(faces(anchor.face, column / 3), column % 3) -= step;
    result.col(column) = (position(anchor, faces, up) - position(anchor, faces, down)) / (2 * step);
  }
  return result;
}

}  // namespace

TEST_CASE("an anchor lies where it was made, on and off the surface") {
  const auto mesh = icosphere(1);
  for (const double height : {-0.3, 0.0, 0.05, 2.0})
    for (std::int32_t face = 0; face < 80; face += 7) {
      const Eigen::Vector3d point = (1 + height) * mesh.vertices.row(face % 42).transpose();
      const auto anchor = makeAnchor(mesh.topology->faces(), mesh.vertices, face, point);
      CHECK((position(anchor, mesh.topology->faces(), mesh.vertices) - point).norm() < 1e-14);
      CHECK(anchor.barycentric.sum() == Approx(1));
      CHECK(anchor.barycentric.minCoeff() >= 0);
    }
}

TEST_CASE("a point above a triangle is offset along the normal only") {
  Vertices vertices(3, 3);
  vertices << 0, 0, 0, 2, 0, 0, 0, 2, 0;
  Faces faces(1, 3);
  faces << 0, 1, 2;
  const auto anchor = makeAnchor(faces, vertices, 0, Eigen::Vector3d(0.5, 1, 0.3));
  CHECK(anchor.barycentric.isApprox(Eigen::Vector3d(0.25, 0.25, 0.5)));
  CHECK((anchor.offset - Eigen::Vector3d(0, 0, 0.3)).norm() < 1e-15);
  const auto beside = makeAnchor(faces, vertices, 0, Eigen::Vector3d(3, 0, 0));
  CHECK(beside.barycentric.isApprox(Eigen::Vector3d(0, 1, 0)));
  CHECK(beside.offset.isApprox(Eigen::Vector3d(1, 0, 0)));
}

TEST_CASE("an anchor moves rigidly with its triangle and keeps its offset when the triangle grows") {
  const auto mesh = icosphere(1);
  const auto& faces = mesh.topology->faces();
  const auto anchor = makeAnchor(faces, mesh.vertices, 5, Eigen::Vector3d(0.4, 0.9, 1.3));
  Vertices with_point(43, 3);
  with_point << mesh.vertices, position(anchor, faces, mesh.vertices).transpose();
  const Vertices moved = moveRigidly(with_point, 11);
  CHECK((position(anchor, faces, moved) - moved.row(42).transpose()).norm() < 1e-13);
  const Vertices grown = 3 * mesh.vertices;
  const Anchor foot{anchor.face, anchor.barycentric, Eigen::Vector3d::Zero()};
  CHECK((position(anchor, faces, grown) - position(foot, faces, grown)).norm() == Approx(anchor.offset.norm()));
}

TEST_CASE("the anchor's Jacobian meets central differences") {
  const auto mesh = icosphere(1);
  const auto& faces = mesh.topology->faces();
  for (const unsigned seed : {1u, 2u, 3u}) {
    const Vertices shape = jitter(mesh.vertices, 0.15, seed);
    for (const double height : {1.0, 1.2, -0.5}) {
      const auto face = static_cast<std::int32_t>(seed * 9);
      const auto anchor = makeAnchor(faces, mesh.vertices, face, height * Eigen::Vector3d(0.3, -0.8, 0.6));
      CHECK((positionJacobian(anchor, faces, shape) - differences(anchor, faces, shape)).norm() < 1e-7);
    }
  }
}

TEST_CASE("an anchor stays finite while its triangle collapses") {
  Vertices vertices(3, 3);
  vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0;
  Faces faces(1, 3);
  faces << 0, 1, 2;
  const auto anchor = makeAnchor(faces, vertices, 0, Eigen::Vector3d(0.2, 0.3, 0.5));
  for (const double height : {1e-3, 1e-9, 1e-15, 0.0}) {
    vertices(2, 1) = height;
    CHECK(position(anchor, faces, vertices).allFinite());
    CHECK(position(anchor, faces, vertices).norm() < 1.5);
  }
  CHECK(position(anchor, faces, Vertices::Zero(3, 3)).norm() == 0);
}

TEST_CASE("an anchor needs a triangle with area") {
  const auto mesh = icosphere(1);
  const auto& faces = mesh.topology->faces();
  CHECK_THROWS_WITH(makeAnchor(faces, mesh.vertices, 80, Eigen::Vector3d::Zero()),
                    Catch::Contains("face: 80 is outside"));
  CHECK_THROWS_WITH(makeAnchor(faces, mesh.vertices, -1, Eigen::Vector3d::Zero()), Catch::Contains("face: -1"));
  CHECK_THROWS_AS(makeAnchor(faces, Vertices::Zero(42, 3), 3, Eigen::Vector3d::Zero()), InvalidInput);
}
