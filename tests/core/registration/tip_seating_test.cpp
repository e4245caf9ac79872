#include "core/registration/tip_seating.h"

#include <Eigen/Geometry>
#include <array>
#include <catch2/catch.hpp>
#include <numbers>

#include "core/body/body_training.h"
#include "core/mesh/quality.h"
#include "core/registration/scan_registration.h"
#include "core/skeleton/rotation.h"
#include "tests/core/registration/scanned_shapes.h"
#include "tests/support/fields.h"

using namespace shaped;
using namespace shaped::test;

namespace {

constexpr std::int32_t kArm = 1, kHand = 2, kFingers = 3;
constexpr double kDegree = std::numbers::pi / 180, kPitch = 12 * kDegree;
constexpr std::array kLengths = {0.075, 0.085, 0.078, 0.060};  ///< of fingers from the side of +y on

double directionOf(std::size_t finger) { return (1.5 - double(finger)) * kPitch; }

/// Ellipsoids: an arm along x, a palm, and four flat fingers that fan out from the origin, each a component.
struct Hand {
  std::vector<Vertices> pieces;

  Hand() {
    add({0.18, 0.04, 0.05}, {-0.25, 0, 0}, 0);
    add({0.06, 0.04, 0.012}, {-0.03, 0, 0}, 0);
    for (std::size_t f = 0; f < kLengths.size(); ++f)
      add({kLengths[f] / 2, 0.009, 0.007}, {0.02 + kLengths[f] / 2, 0, 0}, directionOf(f));
  }

  void add(const Eigen::RowVector3d& axes, const Eigen::RowVector3d& centre, double turn) {
    Vertices piece = icosphere(2).vertices * axes.asDiagonal();
    piece.rowwise() += centre;
    pieces.push_back(piece * rotationMatrix({0, 0, turn}).transpose());
  }
};

struct Whole {
  TopologyPtr topology;
  Vertices rest;
  SkinWeights weights;
};

Whole together(const Hand& hand) {
  const auto sphere = icosphere(2);
  const auto count = sphere.vertices.rows(), faces = sphere.topology->faces().rows();
  const auto pieces = Eigen::Index(hand.pieces.size());
  Faces all(pieces * faces, 3);
  Whole whole{nullptr, Vertices(pieces * count, 3), SkinWeights(pieces * count, 4)};
  for (Eigen::Index p = 0; p < pieces; ++p) {
    all.middleRows(p * faces, faces) = sphere.topology->faces().array() + std::int32_t(p * count);
    whole.rest.middleRows(p * count, count) = hand.pieces[std::size_t(p)];
    for (Eigen::Index v = p * count; v < (p + 1) * count; ++v) {
      const double x = whole.rest(v, 0);
      const std::int32_t bone = p == 0 ? kArm : p == 1 ? kHand : kFingers;
      // Bones meet at their joints, so that these follow the identity.
      const double above = bone == kHand && x < -0.06 ? 0.3 : 0, below = bone == kHand && x > 0 ? 0.3 : 0;
      if (above > 0) whole.weights.insert(v, kArm) = above;
      whole.weights.insert(v, bone) = 1 - above - below;
      if (below > 0) whole.weights.insert(v, kFingers) = below;
    }
    if (p == 0)
      for (Eigen::Index v = 0; v < count; ++v)
        if (whole.rest(v, 0) < -0.38) {
          whole.weights.coeffRef(v, kArm) = 0.5;
          whole.weights.insert(v, 0) = 0.5;
        }
  }
  whole.weights.makeCompressed();
  whole.topology = std::make_shared<const Topology>(std::int32_t(pieces * count), all);
  return whole;
}

BodyModel handModel() {
  const auto whole = together({});
  Rig rig{Skeleton({{"trunk", -1}, {"arm", 0}, {"hand", kArm}, {"fingers", kHand}}), Vertices::Zero(4, 3),
          whole.weights, std::nullopt};
  rig.rest_joints.col(0) << -0.43, -0.41, -0.08, 0;
  const auto reference = makePostureTemplate(whole.topology, whole.rest, std::move(rig));
  std::vector<Vertices> identities;
  for (const double size : {0.95, 1.0, 1.05}) identities.push_back(size * whole.rest);
  BodyTrainingOptions options;
  options.modes = 1;
  options.posture = PostureNormalisation::kNone;
  return trainBody(reference, identities, options)->model;
}

/// The hand as cameras might see it: without its outermost finger on the side of -y.
Scan threeFingers(const BodyModel& model, const BodyState& truth) {
  const Scan all = scanPoints({model.topology(), model.posed(truth).vertices()}, 6000);
  return kept(all, [](const Eigen::RowVector3d& p) { return p[0] < 0.02 || std::atan2(p[1], p[0]) > -kPitch; });
}

/// The finest level alone, so few rounds of it that fingers stay in their neighbours' places on either side.
ModelFitOptions briefly() {
  ModelFitOptions options;
  options.levels.erase(options.levels.begin(), options.levels.end() - 1);
  options.levels.front().rounds = 6;
  return options;
}

double errorOf(const BodyModel& model, const BodyState& state, const BodyState& truth) {
  return meanVertexDistance(model.posed(state).vertices(), model.posed(truth).vertices());
}

}  // namespace

TEST_CASE("tips are the small parts at the ends of limbs") {
  const auto model = handModel();
  CHECK(tipsOf(model, 0.12) == std::vector<std::int32_t>{kFingers});
  CHECK(tipsOf(model, 0.25) == std::vector<std::int32_t>{kHand});
  CHECK(tipsOf(model, 0).empty());
}

TEST_CASE("fingers in their neighbours' places are seated, and those that lie right are left alone") {
  const auto model = handModel();
  const BodyState truth = model.meanState();
  const ScanSurface scan(threeFingers(model, truth));
  for (const double side : {1.0, -1.0}) {
    BodyState shifted = truth;
    shifted.pose.rotations(kFingers, 2) = side * kPitch;
    const auto stuck = fitStateToScan(scan, model, shifted, {}, briefly()).solution;
    CAPTURE(side, errorOf(model, stuck, truth));
    CHECK(errorOf(model, stuck, truth) > 3e-3);  // closest points alone leave them there
    BodyState seated = stuck;
    CHECK(seatTips(scan, model, seated.identity, seated.pose) == 1);
    CHECK(errorOf(model, seated, truth) < 1.5e-3);
  }
  Pose right = truth.pose;
  CHECK(seatTips(scan, model, truth.identity, right) == 0);
  CHECK(right.rotations == truth.pose.rotations);
  TipOptions none;
  none.reaches = {0, 0};
  CHECK(seatTips(scan, model, truth.identity, right, none) == 0);
  none.tilt = 0;
  CHECK_THROWS_WITH(seatTips(scan, model, truth.identity, right, none),
                    Catch::Contains("tilt = 0.000000, want (0, 180] degrees"));
  std::stop_source source;
  source.request_stop();
  Pose stopped = truth.pose;
  stopped.rotations(kFingers, 2) = -kPitch;
  const Pose before = stopped;
  CHECK(seatTips(scan, model, truth.identity, stopped, {}, source.get_token()) == 0);
  CHECK(stopped.rotations == before.rotations);
}

TEST_CASE("a hand turned in its wrist is seated, which its fingers alone are not") {
  const auto model = handModel();
  const BodyState truth = model.meanState();
  const ScanSurface scan(threeFingers(model, truth));
  BodyState turned = truth;
  turned.pose.rotations(kHand, 2) = -8 * kDegree;
  turned.pose.rotations(kFingers, 2) = -4 * kDegree;
  BodyState seated = turned;
  CHECK(seatTips(scan, model, seated.identity, seated.pose) == 1);
  CHECK(errorOf(model, seated, truth) < 1.5e-3);
  TipOptions fingers;
  fingers.reaches = {0, 0.12};
  seatTips(scan, model, turned.identity, turned.pose, fingers);
  CHECK(errorOf(model, turned, truth) > 2e-3);
}

TEST_CASE("registering seats fingers that the fit left beside their places") {
  const auto model = handModel();
  const BodyState truth = model.meanState();
  BodyState shifted = truth;
  shifted.pose.rotations(kFingers, 2) = -kPitch;
  ScanRegistrationOptions options;
  options.fit = briefly();
  const Scan scan = threeFingers(model, truth);
  const auto seated = registerScanFrom(scan, model, shifted, {}, options);
  options.tips.reaches = {0, 0};
  const auto left = registerScanFrom(scan, model, shifted, {}, options);
  CHECK(errorOf(model, left.solution.state, truth) > 3e-3);
  CHECK(errorOf(model, seated.solution.state, truth) < 1.5e-3);
  CHECK(seated.iterations > left.iterations);
  CHECK(seated.solution.report.chamfer < left.solution.report.chamfer);
}

TEST_CASE("a pose fitted anew for a field's surface has its tips seated") {
  const auto model = handModel();
  const BodyState truth = model.meanState();
  BodyState shifted = truth;
  shifted.pose.rotations(kFingers, 2) = -kPitch;
  const ScanSurface scan(threeFingers(model, truth));
  const auto reference =
      std::make_shared<const FieldReference>(*makeFieldReference(model.topology(), model.parts().mean));
  const FieldDeformation silent(reference, constantField(scalingOf(*reference)));
  const Vertices surface = model.posed(truth).vertices();
  const auto seated = silent.deform(model, shifted, scan, briefly());
  TipOptions none;
  none.reaches = {0, 0};
  const auto left = silent.deform(model, shifted, scan, briefly(), none);
  REQUIRE((seated && left));
  CHECK(meanVertexDistance(left->posed, surface) > 3e-3);
  CHECK(meanVertexDistance(seated->posed, surface) < 1.5e-3);
  CHECK(seated->rest == left->rest);
  CHECK(seated->rest == silent.atRest(model, shifted, scan, briefly())->rest);
}
