#include <algorithm>

#include "server/convert/mesh.h"
#include "tests/fuzz/wire.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::fuzz;

FUZZ_WIRE_TARGET(wire_shape, shaped::v1::Shape) {
  static const auto sphere = test::icosphere(0);
  const auto message = parsed<v1::Shape>(bytes);
  if (!message) return;
  const auto shape =
      accepted<InvalidInput>([&] { return server::shapeFromProto(*message, *sphere.topology, "shape"); });
  if (!shape) return;
  requireValidShape(*sphere.topology, *shape, "shape");
  v1::Shape back;
  server::toProto(*shape, *sphere.topology, back);
  require(std::ranges::equal(back.positions(), message->positions()), "positions survive");
}
