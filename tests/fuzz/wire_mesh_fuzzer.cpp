#include <algorithm>

#include "core/mesh/topology.h"
#include "server/convert/mesh.h"
#include "tests/fuzz/wire.h"

using namespace shaped;
using namespace shaped::fuzz;

FUZZ_WIRE_TARGET(wire_mesh, shaped::v1::Mesh) {
  const auto message = parsed<v1::Mesh>(bytes);
  if (!message) return;
  const auto mesh = accepted<InvalidInput>([&] { return server::meshFromProto(*message, {}, "mesh"); });
  if (!mesh) return;
  requireOneComponent(*mesh->topology, "mesh");
  requireValidShape(*mesh->topology, mesh->vertices, "mesh");
  v1::Mesh back;
  server::toProto(mesh->vertices, *mesh->topology, back);
  require(std::ranges::equal(back.positions(), message->positions()), "positions survive");
  require(std::ranges::equal(back.faces(), message->faces()), "faces survive");
}
