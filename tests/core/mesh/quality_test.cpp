#include "core/mesh/quality.h"

#include <catch2/catch.hpp>

#include "core/numerics/error.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;

namespace {

/// The unit cube's corners and its twelve triangles, seen from outside.
struct Cube {
  Vertices vertices{8, 3};
  Faces faces{12, 3};

  Cube() {
    for (int v = 0; v < 8; ++v) vertices.row(v) << (v & 1), (v >> 1 & 1), (v >> 2 & 1);
    faces << 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5;
  }
};

}  // namespace

TEST_CASE("areas and qualities of known triangles") {
  Vertices vertices(6, 3);
  vertices << 0, 0, 0, 1, 0, 0, 0.5, std::sqrt(0.75), 0,  // equilateral
      3, 0, 0, 0, 4, 0, 0, 0, 0;                          // 3-4-5, turned
  Faces faces(3, 3);
  faces << 0, 1, 2, 3, 4, 5, 0, 1, 1;
  const auto areas = triangleAreas(faces, vertices), qualities = triangleQualities(faces, vertices);
  CHECK(areas[0] == Approx(std::sqrt(3.0) / 4));
  CHECK(areas[1] == Approx(6));
  CHECK(qualities[0] == Approx(1));
  CHECK(qualities[1] == Approx(4 * std::sqrt(3.0) * 6 / 50));
  CHECK(qualities[2] == 0);
  vertices.setZero();
  CHECK(triangleQualities(faces, vertices)[0] == 0);
}

TEST_CASE("the smallest area ratio finds the triangle that shrank most") {
  const Cube cube;
  Vertices stretched = cube.vertices;
  stretched.col(0) *= 0.25;  // faces across x keep their area, the others lose three quarters
  CHECK(smallestAreaRatio(cube.faces, cube.vertices, stretched) == Approx(0.25));
  CHECK(smallestAreaRatio(cube.faces, cube.vertices, 3 * cube.vertices) == Approx(9));
  CHECK_THROWS_AS(smallestAreaRatio(cube.faces, cube.vertices, stretched.topRows(7)), InvalidInput);
}

TEST_CASE("normals point outwards and have unit length") {
  const Cube cube;
  const auto face_normals = faceNormals(cube.faces, cube.vertices);
  CHECK(face_normals.row(0).isApprox(Eigen::RowVector3d(0, 0, -1)));
  CHECK(face_normals.row(11).isApprox(Eigen::RowVector3d(1, 0, 0)));
  const auto normals = vertexNormals(cube.faces, cube.vertices);
  for (int v = 0; v < 8; ++v) {
    CHECK(normals.row(v).norm() == Approx(1));
    CHECK(normals.row(v).dot(cube.vertices.row(v) - Eigen::RowVector3d::Constant(0.5)) > 0.7);
  }
  CHECK(faceNormals(cube.faces, Vertices::Zero(8, 3)).norm() == 0);
}

TEST_CASE("distances between corresponding vertices") {
  const Cube cube;
  CHECK(boundingBoxDiagonal(cube.vertices) == Approx(std::sqrt(3.0)));
  CHECK(boundingBoxDiagonal(Vertices(0, 3)) == 0);
  Vertices moved = cube.vertices;
  moved(5, 2) += 4;
  CHECK(meanVertexDistance(cube.vertices, moved) == Approx(0.5));
  CHECK(rmsVertexDistance(cube.vertices, moved) == Approx(std::sqrt(2.0)));
  CHECK(maxVertexDistance(cube.vertices, moved) == Approx(4));
  CHECK_THROWS_WITH(meanVertexDistance(cube.vertices, moved.topRows(3)), Catch::Contains("has 3 vertices, want 8"));
  CHECK_THROWS_AS(maxVertexDistance(Vertices(0, 3), Vertices(0, 3)), InvalidInput);
}

TEST_CASE("the diameter is the largest distance of any two vertices, however they stand") {
  CHECK(diameter(Vertices()) == 0);
  CHECK(diameter(Cube().vertices) == Approx(std::sqrt(3.0)));
  const auto pipe = tube(9, 6);
  double widest = 0;
  for (Eigen::Index i = 0; i < pipe.vertices.rows(); ++i)
    for (Eigen::Index j = 0; j < i; ++j)
      widest = std::max(widest, (pipe.vertices.row(i) - pipe.vertices.row(j)).norm());
  CHECK(diameter(pipe.vertices) == widest);
  const Vertices moved = moveRigidly(pipe.vertices, 3);
  CHECK(diameter(moved) == Approx(widest).epsilon(1e-13));
  CHECK(std::abs(boundingBoxDiagonal(moved) / boundingBoxDiagonal(pipe.vertices) - 1) > 1e-3);  // the control
}
