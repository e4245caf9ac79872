#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>

#include "core/mesh/quality.h"
#include "core/mesh/topology.h"
#include "core/sample/isotropic_remeshing.h"
#include "core/sample/marching_tetrahedra.h"
#include "tests/core/sample/sample_fixture.h"

using namespace shaped;

namespace {

const Eigen::Vector3d low(-1.5, -1.5, -1.5), high(1.5, 1.5, 1.5);

double sphere(const Eigen::Vector3d& x) { return x.norm() - 1; }

double torus(const Eigen::Vector3d& x) { return std::hypot(std::hypot(x.x(), x.z()) - 0.9, x.y()) - 0.4; }

Topology topologyOf(const SurfaceMesh& mesh) { return {std::int32_t(mesh.vertices.rows()), mesh.faces}; }

double enclosedVolume(const SurfaceMesh& mesh) {
  double volume = 0;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    const Eigen::RowVector3d a = mesh.vertices.row(mesh.faces(f, 0));
    const Eigen::RowVector3d b = mesh.vertices.row(mesh.faces(f, 1)), c = mesh.vertices.row(mesh.faces(f, 2));
    volume += a.dot(b.cross(c)) / 6;
  }
  return volume;
}

}  // namespace

TEST_CASE("marching tetrahedra make a closed sphere that faces outwards") {
  const auto mesh = marchTetrahedra(sphere, low, high, 0.1);
  const Topology topology = topologyOf(mesh);
  CHECK(topology.closed());
  CHECK(topology.componentCount() == 1);
  CHECK(eulerNumber(topology) == 2);
  CHECK(enclosedVolume(mesh) == Approx(4.0 / 3 * M_PI).epsilon(0.01));
  CHECK((mesh.vertices.rowwise().norm().array() - 1).abs().maxCoeff() < 0.01);
}

TEST_CASE("marching tetrahedra keep a hole, also where the surface runs through grid corners") {
  const auto ring = topologyOf(marchTetrahedra(torus, low, high, 0.1));
  CHECK(ring.closed());
  CHECK(eulerNumber(ring) == 0);
  const auto cube =
      marchTetrahedra([](const Eigen::Vector3d& x) { return x.cwiseAbs().maxCoeff() - 1; }, low, high, 0.25);
  CHECK(topologyOf(cube).closed());
  CHECK(triangleAreas(cube.faces, cube.vertices).minCoeff() > 0);
}

TEST_CASE("remeshing gives even triangles of the wanted size on the surface") {
  const auto fine = marchTetrahedra(sphere, low, high, 0.1);
  const double wanted = 0.2;
  const auto mesh = remeshIsotropically(
      fine, [&](const Eigen::Vector3d&) { return wanted; }, [](const Eigen::Vector3d& x) { return x.normalized(); });
  const Topology topology = topologyOf(mesh);
  CHECK(topology.closed());
  CHECK(eulerNumber(topology) == 2);
  CHECK((mesh.vertices.rowwise().norm().array() - 1).abs().maxCoeff() < 1e-12);
  const auto qualities = triangleQualities(mesh.faces, mesh.vertices);
  CHECK(qualities.minCoeff() > 0.75);
  CHECK(qualities.mean() > 0.95);
  CHECK(triangleQualities(fine.faces, fine.vertices).minCoeff() < 0.3);  // what it started from
  for (const auto& edge : topology.edges()) {
    const double length = (mesh.vertices.row(edge[0]) - mesh.vertices.row(edge[1])).norm();
    CHECK(length > 0.6 * wanted);
    CHECK(length < 1.5 * wanted);
  }
}

TEST_CASE("remeshing keeps a hole and follows a size that varies") {
  const auto project = [](const Eigen::Vector3d& x) {
    const Eigen::Vector3d ring = 0.9 * Eigen::Vector3d(x.x(), 0, x.z()).normalized();
    return Eigen::Vector3d(ring + 0.4 * (x - ring).normalized());
  };
  const auto size = [](const Eigen::Vector3d& x) { return x.x() > 0 ? 0.12 : 0.24; };
  const auto mesh = remeshIsotropically(marchTetrahedra(torus, low, high, 0.08), size, project);
  const Topology topology = topologyOf(mesh);
  CHECK(eulerNumber(topology) == 0);
  double fine = 0, coarse = 0;
  int fine_count = 0, coarse_count = 0;
  for (const auto& edge : topology.edges()) {
    const double length = (mesh.vertices.row(edge[0]) - mesh.vertices.row(edge[1])).norm();
    const double x = mesh.vertices(edge[0], 0);
    if (x > 0.4) fine += length, ++fine_count;
    if (x < -0.4) coarse += length, ++coarse_count;
  }
  CHECK(coarse / coarse_count > 1.6 * fine / fine_count);
}
