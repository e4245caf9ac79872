#include "server/convert/curve.h"
#include "tests/fuzz/wire.h"

using namespace shaped;
using namespace shaped::fuzz;

FUZZ_WIRE_TARGET(wire_join, shaped::v1::JoinRequest) {
  const auto message = parsed<v1::JoinRequest>(bytes);
  if (!message) return;
  JoinOptions options;
  const auto up = accepted<InvalidInput>([&] { return server::upFromProto(message->up()); });
  if (up) options.up = *up;
  const auto geodesic =
      accepted<InvalidInput>([&] { return server::geodesicFromProto(message->options(), "options"); });
  if (geodesic) options.geodesic = *geodesic;
  const auto transition = accepted<InvalidInput>(
      [&] { return server::numberFromProto(message->transition_frames(), 0, 0, 1000, "transition_frames"); });
  if (transition) options.transition = *transition;
  const auto reach =
      accepted<InvalidInput>([&] { return server::numberFromProto(message->reach(), 0, 0, 10'000, "reach"); });
  if (reach) options.reach = *reach;
  require(!options.firstViolation(), "accepted options are valid");
  const auto smoothing =
      accepted<InvalidInput>([&] { return server::smoothingFromProto(message->flow(), 2000, 50, "flow"); });
  if (smoothing) require(!smoothing->firstViolation(2), "accepted smoothing is valid");
}
