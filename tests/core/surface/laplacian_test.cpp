#include "core/surface/laplacian.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <limits>
#include <numbers>

#include "core/mesh/quality.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;

namespace {

Eigen::MatrixXd dense(const Eigen::SparseMatrix<double>& matrix) { return matrix; }

/// The integral of |grad u|^2, each triangle's gradient solved for in the plane that it spans.
double dirichletEnergy(const Vertices& vertices, const Faces& faces, const Eigen::VectorXd& u) {
  double energy = 0;
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    Eigen::Matrix<double, 2, 3> edges;
    edges << vertices.row(faces(f, 1)) - vertices.row(faces(f, 0)),
        vertices.row(faces(f, 2)) - vertices.row(faces(f, 0));
    const Eigen::Vector2d rise(u[faces(f, 1)] - u[faces(f, 0)], u[faces(f, 2)] - u[faces(f, 0)]);
    const Eigen::Matrix2d metric = edges * edges.transpose();
    energy += rise.dot(metric.inverse() * rise) * std::sqrt(metric.determinant()) / 2;
  }
  return energy;
}

Eigen::VectorXd randomFunction(Eigen::Index size) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  return Eigen::VectorXd::NullaryExpr(size, [&] { return uniform(random); });
}

/// A sphere on which some triangles are needles, some have no area and some are points.
Vertices degenerate(const Mesh& sphere) {
  Vertices vertices = sphere.vertices;
  const auto& faces = sphere.topology->faces();
  vertices.row(faces(0, 1)) = vertices.row(faces(0, 0));
  vertices.row(faces(0, 2)) = vertices.row(faces(0, 0));
  vertices.row(faces(50, 1)) = 0.3 * vertices.row(faces(50, 0)) + 0.7 * vertices.row(faces(50, 2));
  const Eigen::RowVector3d sideways(1e-9, -2e-9, 1e-9);
  vertices.row(faces(100, 1)) = 0.5 * vertices.row(faces(100, 0)) + 0.5 * vertices.row(faces(100, 2)) + sideways;
  return vertices;
}

}  // namespace

TEST_CASE("the cotangent stiffness of an equilateral triangle is known") {
  Vertices vertices(3, 3);
  vertices << 0, 0, 0, 2, 0, 0, 1, std::sqrt(3), 0;
  const Faces faces = Eigen::RowVector3i(0, 1, 2);
  Eigen::Matrix3d expected;
  expected << 2, -1, -1, -1, 2, -1, -1, -1, 2;
  expected *= 0.5 / std::sqrt(3);
  CHECK(dense(cotangentStiffness(vertices, faces)).isApprox(expected, 1e-14));
  CHECK(lumpedAreas(vertices, faces).isApprox(Eigen::Vector3d::Constant(1 / std::sqrt(3)), 1e-14));
}

TEST_CASE("the stiffness measures a function's squared gradient, whatever the triangles") {
  const auto mesh = icosphere(2);
  const Vertices shape = jitter(mesh.vertices, 0.05, 1);
  const auto stiffness = cotangentStiffness(shape, mesh.topology->faces());
  const auto u = randomFunction(shape.rows());
  CHECK(u.dot(stiffness * u) == Approx(dirichletEnergy(shape, mesh.topology->faces(), u)).epsilon(1e-12));
  CHECK(dense(stiffness) == dense(stiffness).transpose());
  CHECK((stiffness * Eigen::VectorXd::Ones(shape.rows())).cwiseAbs().maxCoeff() < 1e-13);
}

TEST_CASE("a flat sheet's stiffness is the five-point stencil, and linear functions are harmonic inside") {
  const auto mesh = grid(6);
  const auto stiffness = dense(cotangentStiffness(mesh.vertices, mesh.topology->faces()));
  const Eigen::VectorXd flux = stiffness * mesh.vertices * Eigen::Vector3d(2, -3, 1);
  for (int v = 0; v < 36; ++v) {
    if (v % 6 == 0 || v % 6 == 5 || v < 6 || v >= 30) continue;
    CHECK(std::abs(flux[v]) < 1e-13);
    CHECK(stiffness(v, v) == Approx(4));
    for (const int neighbour : {v - 1, v + 1, v - 6, v + 6}) CHECK(stiffness(v, neighbour) == Approx(-1));
  }
  CHECK(flux.cwiseAbs().maxCoeff() > 0.1);  // the boundary holds it
}

TEST_CASE("stiffness is semi-definite with one constant a component, and has no unit") {
  const auto mesh = icosphere(1);
  const auto count = mesh.vertices.rows(), faces = mesh.topology->faces().rows();
  Vertices twice(2 * count, 3);
  twice << jitter(mesh.vertices, 0.1, 1), jitter(mesh.vertices, 0.1, 2);
  Faces both(2 * faces, 3);
  both << mesh.topology->faces(), mesh.topology->faces().array() + static_cast<int>(count);
  const auto stiffness = dense(cotangentStiffness(twice, both));
  const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(stiffness).eigenvalues();
  CHECK(values.head(2).cwiseAbs().maxCoeff() < 1e-13);
  CHECK(values[2] > 0.1);
  CHECK(dense(cotangentStiffness(100 * moveRigidly(twice, 3), both)).isApprox(stiffness, 1e-12));
  CHECK_FALSE(dense(cotangentStiffness(twice * Eigen::Vector3d(1, 1, 2).asDiagonal(), both)).isApprox(stiffness, 0.1));
}

TEST_CASE("lumped areas share out the surface and scale with it") {
  const auto mesh = icosphere(4);
  const auto areas = lumpedAreas(mesh.vertices, mesh.topology->faces());
  CHECK(areas.sum() == Approx(triangleAreas(mesh.topology->faces(), mesh.vertices).sum()));
  CHECK(areas.sum() == Approx(4 * std::numbers::pi).epsilon(5e-3));
  CHECK(areas.minCoeff() > 0);
  CHECK(lumpedAreas(3 * moveRigidly(mesh.vertices, 1), mesh.topology->faces()).isApprox(9 * areas, 1e-12));
}

TEST_CASE("obtuse corners count as they are or as zero, and only then may a weight be negative") {
  Vertices vertices(4, 3);
  vertices << 0, 0, 0, 4, 0, 0, 2, 0.5, 0, 2, -0.5, 0;
  Faces faces(2, 3);
  faces << 0, 1, 2, 1, 0, 3;  // both obtuse opposite the edge that they share
  CHECK(dense(cotangentStiffness(vertices, faces))(0, 1) > 1);
  const auto clamped = dense(cotangentStiffness(vertices, faces, ObtuseCorners::kAsZero));
  CHECK(clamped(0, 1) == 0);
  CHECK(clamped(0, 2) == dense(cotangentStiffness(vertices, faces))(0, 2));
  CHECK((clamped * Eigen::VectorXd::Ones(4)).norm() < 1e-14);
  const auto mesh = icosphere(2);  // nothing obtuse: nothing changes
  CHECK(dense(cotangentStiffness(mesh.vertices, mesh.topology->faces())) ==
        dense(cotangentStiffness(mesh.vertices, mesh.topology->faces(), ObtuseCorners::kAsZero)));
}

TEST_CASE("triangles without area leave the operators finite, symmetric and semi-definite") {
  const auto sphere = icosphere(2);
  const Vertices vertices = degenerate(sphere);
  const auto& faces = sphere.topology->faces();
  REQUIRE(triangleAreas(faces, vertices).minCoeff() < 1e-16);
  for (const auto obtuse : {ObtuseCorners::kAsTheyAre, ObtuseCorners::kAsZero}) {
    const auto stiffness = dense(cotangentStiffness(vertices, faces, obtuse));
    REQUIRE(stiffness.allFinite());
    CHECK(stiffness == stiffness.transpose());
    const auto values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(stiffness).eigenvalues();
    CHECK(values[0] > -1e-14 * values[values.size() - 1]);
  }
  CHECK(lumpedAreas(vertices, faces).allFinite());
  CHECK(lumpedAreas(vertices, faces).minCoeff() >= 0);
}

TEST_CASE("surface operators refuse a broken mesh by name") {
  const auto mesh = icosphere(0);
  Faces wrong = mesh.topology->faces();
  wrong(3, 1) = 12;
  CHECK_THROWS_WITH(cotangentStiffness(mesh.vertices, wrong),
                    Catch::Contains("faces[3]: has a vertex index outside [0, 12)"));
  CHECK_THROWS_WITH(lumpedAreas(mesh.vertices, Faces(0, 3)),
                    Catch::Contains("faces: a surface needs at least one face"));
  Vertices broken = mesh.vertices;
  broken(2, 2) = std::numeric_limits<double>::infinity();
  CHECK_THROWS_WITH(cotangentStiffness(broken, mesh.topology->faces()), Catch::Contains("vertices"));
}
