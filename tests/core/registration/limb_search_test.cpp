#include "core/registration/limb_search.h"

#include <catch2/catch.hpp>

#include "core/mesh/quality.h"
#include "core/sample/virtual_scanner.h"
#include "tests/support/bodies.h"

using namespace shaped;
using namespace shaped::test;

namespace {

/// A tube of four joints whose far half counts as a limb.
LimbSearchOptions tubeLimbs() {
  LimbSearchOptions options;
  options.largest_share = 0.8;
  options.shortest_bone = 0.05;
  options.loss_scale = 0.2;  // the tube is four metres long
  return options;
}

Scan scanOf(const BodyModel& model, const BodyState& state) {
  VirtualScannerOptions scanner;
  scanner.ring_radius = 8;
  scanner.above = scanner.below = 4;
  scanner.points = 6000;
  scanner.motion = RigidMotion{};
  return scanVirtually(model.posed(state).vertices(), model.topology()->faces(), scanner).scan;
}

}  // namespace

TEST_CASE("a limb that is bent far from where it is searched is seated, and one in its place is left alone") {
  const BodyModel model = tubeModel(4, 12, 3);
  const auto limbs = limbsOf(model, tubeLimbs());
  REQUIRE_FALSE(limbs.empty());
  BodyState truth = model.meanState();
  truth.pose.rotations.row(limbs.front().upper) << 0, 0, 1.2;
  const ScanSurface scan(scanOf(model, truth));
  const auto distance = [&](const BodyState& state) {
    return meanVertexDistance(model.posed(state).vertices(), model.posed(truth).vertices());
  };
  const auto found = searchLimbs(scan, model, model.meanState(), tubeLimbs());
  CHECK(found.turned >= 1);
  CHECK(distance(found.state) < 0.3 * distance(model.meanState()));
  CHECK(searchLimbs(scan, model, truth, tubeLimbs()).turned == 0);
}

TEST_CASE("a limb search keeps to the joints' limits, stops when asked to, and names options out of range") {
  const BodyModel model = tubeModel(4, 12, 3);
  const auto limbs = limbsOf(model, tubeLimbs());
  BodyState truth = model.meanState();
  truth.pose.rotations.row(limbs.front().upper) << 0, 0, 1.2;
  const ScanSurface scan(scanOf(model, truth));

  BodyParts parts = model.parts();
  const Vertices bound = Vertices::Constant(model.skeleton().jointCount(), 3, 0.1);
  parts.limits = JointLimits{-bound, bound};
  const BodyModel stiff(parts);
  const auto kept = searchLimbs(scan, stiff, stiff.meanState(), tubeLimbs()).state.pose;
  CHECK(kept.rotations.cwiseAbs().maxCoeff() <= 0.1);

  std::stop_source source;
  source.request_stop();
  CHECK(searchLimbs(scan, model, model.meanState(), tubeLimbs(), source.get_token()).turned == 0);
  LimbSearchOptions options;
  options.samples = 3;
  CHECK_THROWS_WITH(searchLimbs(scan, model, truth, options), Catch::Contains("samples = 3, want >= 50"));
}
