#include "server/convert/mesh.h"

#include <catch2/catch.hpp>

#include "core/numerics/error.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::server;
using Catch::Contains;

TEST_CASE("a mesh survives the wire to float precision") {
  const auto sphere = test::icosphere(1);
  v1::Mesh wire;
  toProto(sphere.vertices, *sphere.topology, wire);
  const auto back = meshFromProto(wire, Limits(), "mesh");
  CHECK(back.topology->id() == sphere.topology->id());
  CHECK((back.vertices - sphere.vertices).cwiseAbs().maxCoeff() < 1e-7);
  CHECK((back.vertices - sphere.vertices).cwiseAbs().maxCoeff() > 0);
}

TEST_CASE("a faulty mesh is refused with the field's path") {
  const auto sphere = test::icosphere(0);
  v1::Mesh good;
  toProto(sphere.vertices, *sphere.topology, good);
  auto mesh = good;
  mesh.add_positions(1);
  CHECK_THROWS_WITH(meshFromProto(mesh, Limits(), "from"), Contains("from.positions: has 37 numbers"));
  mesh = good;
  mesh.set_positions(4, std::numeric_limits<float>::quiet_NaN());
  CHECK_THROWS_WITH(meshFromProto(mesh, Limits(), "from"), Contains("from: vertices: vertex 1 has a coordinate"));
  mesh = good;
  mesh.add_faces(0);
  CHECK_THROWS_WITH(meshFromProto(mesh, Limits(), "from"), Contains("from.faces: has 61 indices"));
  mesh = good;
  mesh.set_faces(3, 4000000000U);
  CHECK_THROWS_WITH(meshFromProto(mesh, Limits(), "from"),
                    Contains("from.faces[1]: vertex index 4000000000 is outside [0, 12)"));
  mesh = good;
  for (int corner = 0; corner < 3; ++corner) mesh.add_faces(good.faces(corner));
  CHECK_THROWS_WITH(meshFromProto(mesh, Limits(), "from"), Contains("from: faces: edge"));
  CHECK_THROWS_WITH(meshFromProto(v1::Mesh(), Limits(), "from"), Contains("from.faces: has 0 indices"));
}

TEST_CASE("a mesh beyond the server's limits is refused before anything is built of it") {
  const auto sphere = test::icosphere(0);
  v1::Mesh mesh;
  toProto(sphere.vertices, *sphere.topology, mesh);
  Limits limits;
  limits.vertices = 12;
  limits.faces = 20;
  CHECK_NOTHROW(meshFromProto(mesh, limits, "from"));
  limits.vertices = 11;
  CHECK_THROWS_WITH(meshFromProto(mesh, limits, "from"),
                    Contains("from.faces: has 12 vertices to refer to, want at most 11"));
  limits.vertices = 12;
  limits.faces = 19;
  CHECK_THROWS_WITH(meshFromProto(mesh, limits, "from"), Contains("from.faces: has 20 faces, want at most 19"));
  // 3 x 2^31 vertices would wrap around in 32 bits, and a tiny message must not make the server allocate for them.
  CHECK_THROWS_WITH(facesFromProto(mesh.faces(), std::int64_t{1} << 31, Limits(), "header.faces"),
                    Contains("header.faces: has 2147483648 vertices to refer to"));
}

TEST_CASE("a shape must fit the model's topology") {
  const auto sphere = test::icosphere(0);
  v1::Shape wire;
  toProto(sphere.vertices, *sphere.topology, wire);
  CHECK_NOTHROW(shapeFromProto(wire, *sphere.topology, "shape"));
  auto shape = wire;
  shape.mutable_positions()->Truncate(33);
  CHECK_THROWS_WITH(shapeFromProto(shape, *sphere.topology, "shape"), Contains("shape: has 11 vertices, want 12"));
  shape.mutable_positions()->Truncate(32);
  CHECK_THROWS_WITH(shapeFromProto(shape, *sphere.topology, "shape"), Contains("shape.positions: has 32 numbers"));
  shape = wire;
  shape.set_topology_id("0123");
  CHECK_THROWS_WITH(shapeFromProto(shape, *sphere.topology, "shape"), Contains("shape.topology_id: is 0123"));
  shape = wire;
  shape.clear_topology_id();
  shape.set_positions(7, std::numeric_limits<float>::infinity());
  CHECK_THROWS_WITH(shapeFromProto(shape, *sphere.topology, "shape"), Contains("shape: vertex 2 has a coordinate"));
}
