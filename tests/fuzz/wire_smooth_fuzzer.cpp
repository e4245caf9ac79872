#include "server/convert/curve.h"
#include "tests/fuzz/wire.h"

using namespace shaped;
using namespace shaped::fuzz;

namespace {

constexpr std::int64_t kFrames = 7;

}  // namespace

FUZZ_WIRE_TARGET(wire_smooth, shaped::v1::SmoothRequest) {
  const auto message = parsed<v1::SmoothRequest>(bytes);
  if (!message) return;
  const auto options =
      accepted<InvalidInput>([&] { return server::smoothingFromProto(message->flow(), 2000, 10, "flow"); });
  if (options) require(!options->firstViolation(kFrames), "accepted options are valid");
  const auto restore = accepted<InvalidInput>([&] { return server::restoreFromProto(message->restore(), kFrames); });
  const auto held = accepted<InvalidInput>([&] { return server::heldFromProto(message->held(), kFrames); });
  if (options && restore && held) {
    auto all = *options;
    all.flow.restore = *restore;
    all.flow.held = *held;
    require(!all.firstViolation(kFrames), "accepted forces and masks fit the frames");
  }
  const auto bending = accepted<InvalidInput>([&] { return server::bendingFromProto(message->bending(), 1e-4); });
  if (bending) require(*bending > 0, "bending is positive");
  accepted<InvalidInput>([&] { return server::numberFromProto(message->window(), 160, 8, 10'000, "window"); });
  accepted<InvalidInput>([&] { return server::requireCurveFits(message->window(), 2000, {}, "window"), true; });
}
