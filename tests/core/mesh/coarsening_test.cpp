#include "core/mesh/coarsening.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <set>

#include "core/io/frames.h"
#include "core/io/mesh_file.h"
#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "tests/support/real_data.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;

namespace {

CoarseningOptions target(std::int32_t vertex_count) {
  CoarseningOptions options;
  options.vertex_count = vertex_count;
  return options;
}

auto eulerCharacteristic(const Topology& topology) {
  return topology.vertexCount() - static_cast<long>(topology.edges().size()) + topology.faces().rows();
}

double volume(const Faces& faces, const Vertices& shape) {
  double six = 0;
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const Eigen::Vector3d a = shape.row(faces(f, 0)), b = shape.row(faces(f, 1)), c = shape.row(faces(f, 2));
    six += a.dot(b.cross(c));
  }
  return six / 6;
}

double smallestFoldCosine(const Topology& topology, const Vertices& shape) {
  const auto normals = faceNormals(topology.faces(), shape);
  double smallest = 1;
  for (const auto& hinge : topology.hinges())
    smallest = std::min(smallest, normals.row(hinge.faces[0]).dot(normals.row(hinge.faces[1])));
  return smallest;
}

Mesh torus(int around, int across) {
  Mesh mesh;
  mesh.vertices.resize(around * across, 3);
  Faces faces(2 * around * across, 3);
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < across; ++j) {
      const double u = 2 * M_PI * i / around, v = 2 * M_PI * j / across;
      mesh.vertices.row(i * across + j) << (2 + std::cos(v)) * std::cos(u), (2 + std::cos(v)) * std::sin(u),
          std::sin(v);
      const int a = i * across + j, b = (i + 1) % around * across + j;
      const int c = (i + 1) % around * across + (j + 1) % across, d = i * across + (j + 1) % across;
      faces.row(2 * a) << a, b, c;
      faces.row(2 * a + 1) << a, c, d;
    }
  mesh.topology = std::make_shared<Topology>(around * across, faces);
  return mesh;
}

/// A tube in six bends, one of them strong.
std::vector<Vertices> bentTubes(const Mesh& mesh) {
  std::vector<Vertices> shapes;
  for (const double angle : {0.0, 0.5, 1.0, 1.8, -0.7, -1.2}) shapes.push_back(bend(mesh.vertices, angle));
  return shapes;
}

}  // namespace

TEST_CASE("coarsening reaches its target and stays a good surface in every shape") {
  const auto mesh = tube(60, 24);
  const auto shapes = bentTubes(mesh);
  const auto result = coarsen(mesh.topology, shapes, target(200));
  CHECK(result.coarse->vertexCount() == 200);
  CHECK(result.kept.size() == 200);
  CHECK(std::is_sorted(result.kept.begin(), result.kept.end()));
  CHECK(result.coarse->closed());
  CHECK(result.coarse->componentCount() == 1);
  CHECK(eulerCharacteristic(*result.coarse) == 2);
  for (const auto& shape : shapes) {
    const auto coarse = restrictTo(result, shape);
    const auto& faces = result.coarse->faces();
    CHECK_NOTHROW(requireValidShape(*result.coarse, coarse, "coarse"));
    CHECK(triangleQualities(faces, coarse).minCoeff() > 0.2);
    CHECK(smallestFoldCosine(*result.coarse, coarse) > -0.5);
    CHECK(volume(faces, coarse) == Approx(volume(mesh.topology->faces(), shape)).epsilon(0.04));
  }
}

TEST_CASE("coarse vertices are fine vertices") {
  const auto mesh = icosphere(3);
  const auto result = coarsen(mesh.topology, {mesh.vertices}, target(100));
  const auto coarse = restrictTo(result, mesh.vertices);
  for (std::size_t v = 0; v < result.kept.size(); ++v)
    CHECK(coarse.row(static_cast<Eigen::Index>(v)) == mesh.vertices.row(result.kept[v]));
}

TEST_CASE("a flat sheet keeps its outline exactly") {
  const auto mesh = grid(21);
  const auto result = coarsen(mesh.topology, {mesh.vertices}, target(40));
  CHECK(result.coarse->vertexCount() == 40);
  const auto coarse = restrictTo(result, mesh.vertices);
  CHECK(triangleAreas(result.coarse->faces(), coarse).sum() == Approx(1).epsilon(1e-12));
  const std::set<std::int32_t> kept(result.kept.begin(), result.kept.end());
  for (const int corner : {0, 20, 420, 440}) CHECK(kept.contains(corner));
  CHECK(eulerCharacteristic(*result.coarse) == 1);
  CHECK(triangleQualities(result.coarse->faces(), coarse).minCoeff() > 0.2);
}

TEST_CASE("a detail that only one shape shows is kept for all") {
  const auto mesh = grid(31);
  Vertices bumpy = mesh.vertices;
  const auto nearBump = [&](Eigen::Index v) {
    return (mesh.vertices.row(v) - Eigen::RowVector3d(0.3, 0.3, 0)).norm() < 0.15;
  };
  for (Eigen::Index v = 0; v < bumpy.rows(); ++v)
    if (nearBump(v)) bumpy(v, 2) = 0.05 * std::cos(40 * bumpy(v, 0)) * std::cos(40 * bumpy(v, 1));
  const auto keptNearBump = [&](const std::vector<Vertices>& shapes) {
    const auto result = coarsen(mesh.topology, shapes, target(120));
    return std::count_if(result.kept.begin(), result.kept.end(), nearBump);
  };
  CHECK(keptNearBump({mesh.vertices, bumpy}) > 3 * keptNearBump({mesh.vertices}));
}

TEST_CASE("a torus stays a torus") {
  const auto mesh = torus(40, 20);
  const auto result = coarsen(mesh.topology, {mesh.vertices}, target(60));
  CHECK(result.coarse->vertexCount() == 60);
  CHECK(eulerCharacteristic(*result.coarse) == 0);
  CHECK(result.coarse->closed());
}

TEST_CASE("protected vertices stay, however many they are") {
  const auto mesh = tube(40, 16);
  auto options = target(50);
  for (int v = 0; v < 30; ++v) options.protected_vertices.push_back(7 * v + 3);
  const auto contained = [&](const Coarsening& result) {
    return std::includes(result.kept.begin(), result.kept.end(), options.protected_vertices.begin(),
                         options.protected_vertices.end());
  };
  CHECK_FALSE(contained(coarsen(mesh.topology, {mesh.vertices}, target(50))));
  const auto some = coarsen(mesh.topology, {mesh.vertices}, options);
  CHECK(contained(some));
  CHECK(some.coarse->vertexCount() == 50);
  options.vertex_count = 20;
  const auto all = coarsen(mesh.topology, {mesh.vertices}, options);
  CHECK(contained(all));
  CHECK(all.coarse->vertexCount() >= 30);
}

TEST_CASE("a small mesh is kept whole and a closed one never collapses to nothing") {
  const auto mesh = icosphere(1);
  const auto whole = coarsen(mesh.topology, {mesh.vertices}, target(42));
  CHECK(whole.coarse == mesh.topology);
  CHECK(whole.kept.back() == 41);
  const auto least = coarsen(mesh.topology, {mesh.vertices}, target(4));
  CHECK(least.coarse->vertexCount() >= 4);
  CHECK(least.coarse->closed());
  CHECK(volume(least.coarse->faces(), restrictTo(least, mesh.vertices)) > 0);
}

TEST_CASE("coarsening repeats itself") {
  const auto mesh = tube(40, 16);
  const auto shapes = bentTubes(mesh);
  const auto one = coarsen(mesh.topology, shapes, target(90)), two = coarsen(mesh.topology, shapes, target(90));
  CHECK(one.kept == two.kept);
  CHECK(one.coarse->id() == two.coarse->id());
}

TEST_CASE("position and orientation of the shapes do not matter") {
  const auto mesh = tube(40, 16);
  const Vertices bumpy = jitter(mesh.vertices, 0.01, 5);
  const Vertices far = moveRigidly(bumpy, 3).rowwise() + Eigen::RowVector3d(1e4, 0, 0);
  CHECK(coarsen(mesh.topology, {bumpy}, target(90)).kept == coarsen(mesh.topology, {far}, target(90)).kept);
}

TEST_CASE("a stopped coarsening returns what it has") {
  const auto mesh = tube(40, 16);
  std::stop_source source;
  auto options = target(90);
  options.stop = source.get_token();
  source.request_stop();
  const auto result = coarsen(mesh.topology, {mesh.vertices}, options);
  CHECK(result.coarse->vertexCount() == mesh.topology->vertexCount());
}

TEST_CASE("coarsening refuses what it cannot read, by name") {
  const auto mesh = icosphere(1);
  CHECK_THROWS_WITH(coarsen(mesh.topology, {}, target(20)), Catch::Contains("shapes: is empty"));
  CHECK_THROWS_WITH(coarsen(mesh.topology, {mesh.vertices, mesh.vertices.topRows(5)}, target(20)),
                    Catch::Contains("shapes[1]: has 5 vertices"));
  CHECK_THROWS_WITH(coarsen(mesh.topology, {mesh.vertices}, target(3)), Catch::Contains("vertex_count: is 3"));
  auto options = target(20);
  options.protected_vertices = {0, 42};
  CHECK_THROWS_WITH(coarsen(mesh.topology, {mesh.vertices}, options),
                    Catch::Contains("protected_vertices[1]: vertex 42"));
  CHECK_THROWS_WITH(restrictTo(coarsen(mesh.topology, {mesh.vertices}, target(20)), mesh.vertices.topRows(5)),
                    Catch::Contains("shape: has 5 vertices"));
}

TEST_CASE("posed bodies coarsen to closed surfaces of good triangles", "[data]") {
  const auto folder = realData("posed_body/full");
  if (!folder) return;
  const auto file = readMesh(*folder / "template.ply");
  const auto topology = std::make_shared<Topology>(static_cast<std::int32_t>(file.vertices.rows()), file.faces);
  const FrameReader frames(*folder / "poses_f32.npy");
  std::vector<Vertices> shapes;
  for (int frame = 0; frame < 72; frame += 9) shapes.push_back(frames.frame(frame));
  const auto result = coarsen(topology, shapes, target(1000));
  CHECK(result.coarse->vertexCount() == 1000);
  CHECK(result.coarse->closed());
  CHECK(eulerCharacteristic(*result.coarse) == 2);
  long thin = 0;
  for (const auto& shape : shapes)
    thin += (triangleQualities(result.coarse->faces(), restrictTo(result, shape)).array() < 0.2).count();
  CHECK(static_cast<double>(thin) < 0.005 * 8 * 1996);  // the crotch, lips and ears of the fine poses are folded
}
