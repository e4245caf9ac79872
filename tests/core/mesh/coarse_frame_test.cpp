#include "core/mesh/coarse_frame.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include "core/mesh/quality.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;

namespace {

Eigen::Matrix3d gradient(const GradientStencil& stencil, const Vertices& frame) {
  Eigen::Matrix3d result = Eigen::Matrix3d::Zero();
  for (const auto& term : stencil.terms) result += frame.row(term.row).transpose() * term.weight.transpose();
  return result;
}

}  // namespace

TEST_CASE("frame vectors turn and grow with the shape") {
  const auto mesh = tube(8, 6);
  const auto& faces = mesh.topology->faces();
  const auto frame = frameVectors(faces, mesh.vertices);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  CHECK((frameVectors(faces, mesh.vertices * turn.transpose()) - frame * turn.transpose()).norm() < 1e-12);
  CHECK((frameVectors(faces, 2.5 * mesh.vertices) - 2.5 * frame).norm() < 1e-12);
  const auto normals = vertexNormals(faces, mesh.vertices);
  for (int v = 0; v < 50; ++v) CHECK(frame.row(50 + v).normalized().isApprox(normals.row(v)));
}

TEST_CASE("gradients are the identity at rest, a rotation when turned, the factor when scaled") {
  const auto mesh = tube(8, 6);
  const auto& faces = mesh.topology->faces();
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(2.0, Eigen::Vector3d(0, 1, 1).normalized()).toRotationMatrix();
  for (const auto& stencil : gradientStencils(*mesh.topology, mesh.vertices)) {
    const auto of = [&](const Vertices& shape) { return gradient(stencil, frameVectors(faces, shape)); };
    CHECK((of(mesh.vertices) - Eigen::Matrix3d::Identity()).norm() < 1e-12);
    CHECK((of(mesh.vertices * turn.transpose()) - turn).norm() < 1e-12);
    CHECK((of(moveRigidly(mesh.vertices, 4)).determinant() == Approx(1)));
    CHECK((of(0.3 * mesh.vertices) - 0.3 * Eigen::Matrix3d::Identity()).norm() < 1e-12);
  }
}

TEST_CASE("gradients stay bounded where the reference has collapsed") {
  const auto mesh = tube(8, 6);
  Vertices needle = mesh.vertices;
  needle.rightCols<2>() *= 1e-9;
  for (const auto& stencil : gradientStencils(*mesh.topology, needle))
    CHECK(gradient(stencil, frameVectors(mesh.topology->faces(), mesh.vertices)).norm() < 1e3);
}
