#include "core/clothing/extremities.h"

#include <catch2/catch.hpp>

#include "core/body/body_training.h"
#include "core/mesh/quality.h"
#include "core/sample/virtual_scanner.h"
#include "core/skeleton/rotation.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;

namespace {

constexpr std::int32_t kArm = 1, kHand = 2, kFingers = 3;

/// An arm of 0.6 m along x that ends in a hand: flat, and broader on one side, so that every twist can be told.
Vertices armWithHand(Vertices rest) {
  for (auto row : rest.rowwise()) {
    row *= 0.15;
    const double flat = std::clamp((row[0] - 0.08) / 0.06, 0.0, 1.0);
    row[1] *= 1 + flat * (row[1] > 0 ? 0.8 : 0.1);
    row[2] *= 1 - 0.65 * flat;
  }
  return rest;
}

Rig rigAlong(const Vertices& rest, const std::vector<double>& places) {
  Rig rig{Skeleton({{"trunk", -1}, {"arm", 0}, {"hand", 1}, {"fingers", 2}}), Vertices::Zero(4, 3), {}, std::nullopt};
  std::vector<Eigen::Triplet<double>> weights;
  for (std::size_t j = 0; j < places.size(); ++j) {
    rig.rest_joints(Eigen::Index(j), 0) = places[j];
    for (Eigen::Index v = 0; v < rest.rows(); ++v) {
      const auto beyond = [&](std::size_t k) {
        return k == 0 ? 1 : k == places.size() ? 0 : std::clamp((rest(v, 0) - places[k]) / 0.03 + 0.5, 0.0, 1.0);
      };
      const double weight = beyond(j) - beyond(j + 1);
      if (weight > 0) weights.emplace_back(v, j, weight);
    }
  }
  rig.weights = SkinWeights(rest.rows(), Eigen::Index(places.size()));
  rig.weights.setFromTriplets(weights.begin(), weights.end());
  return rig;
}

BodyModel armModel() {
  const auto mesh = tube(60, 24);
  const Vertices rest = armWithHand(mesh.vertices);
  const auto reference = makePostureTemplate(mesh.topology, rest, rigAlong(rest, {-0.28, -0.1, 0.12, 0.22}));
  std::vector<Vertices> identities;
  for (const double girth : {0.9, 1.0, 1.1}) {
    identities.push_back(rest);
    identities.back().rightCols<2>() *= girth;
  }
  BodyTrainingOptions options;
  options.modes = 1;
  options.posture = PostureNormalisation::kNone;
  return trainBody(reference, identities, options)->model;
}

struct Arm {
  BodyModel model = armModel();
  BodyState truth = model.meanState();

  Arm() {
    truth.pose.rotations.row(kArm) << 0, 0, 0.3;
    const Eigen::Matrix3d twist = rotationMatrix({1.7, 0, 0}), tilt = rotationMatrix({0, 0.5, 0.3});
    truth.pose.rotations.row(kHand) = axisAngle(tilt * twist).transpose();
    truth.pose.rotations.row(kFingers) << 0, 0.4, 0;
  }

  Scan scan() const {
    auto scanner = scannerFor(0.65);
    scanner.points = 4000;
    scanner.motion = RigidMotion{};
    return scanVirtually(model.posed(truth).vertices(), model.topology()->faces(), scanner).scan;
  }

  /// The truth with the hand as at rest.
  Pose straight() const {
    Pose pose = truth.pose;
    pose.rotations.bottomRows<2>().setZero();
    return pose;
  }

  double distance(const Pose& pose) const {
    return meanVertexDistance(model.posed({truth.identity, pose}).vertices(), model.posed(truth).vertices());
  }

  bool seat(const ScanSurface& surface, Pose& pose, std::span<const Pose> others = {},
            const std::stop_token& stop = {}) const {
    return seatExtremity(surface, model, truth.identity, kHand, others, pose, {}, stop);
  }
};

}  // namespace

TEST_CASE("a hand that is turned over and bent is found, and one in its place is left alone") {
  const Arm arm;
  const ScanSurface scan(arm.scan());
  Pose pose = arm.straight();
  CHECK(arm.seat(scan, pose));
  CAPTURE(arm.distance(arm.straight()), arm.distance(pose));
  CHECK(arm.distance(pose) < 0.05 * arm.distance(arm.straight()));
  CHECK(pose.rotations.row(0) == arm.truth.pose.rotations.row(0));
  CHECK((pose.rotations.row(kArm) - arm.truth.pose.rotations.row(kArm)).norm() < 0.03);
  CHECK(pose.translation == arm.truth.pose.translation);

  pose = arm.truth.pose;
  CHECK_FALSE(arm.seat(scan, pose));
  CHECK(pose.rotations == arm.truth.pose.rotations);
}

TEST_CASE("a hand whose arm stands a little off is brought into place by the joint above") {
  const Arm arm;
  const ScanSurface scan(arm.scan());
  Pose pose = arm.truth.pose;
  pose.rotations(kArm, 2) += 0.04;
  const double off = arm.distance(pose);
  CHECK(arm.seat(scan, pose));
  CHECK(arm.distance(pose) < 0.4 * off);
}

TEST_CASE("a hand that the scan does not show stays as it is, and one that it hardly shows goes where others have it") {
  const Arm arm;
  Scan scan = arm.scan();
  const Eigen::RowVector3d wrist = arm.model.posed(arm.truth).skeleton().joints.row(kHand);
  const auto keep = [&](int every) {
    Scan kept;
    std::vector<Eigen::Index> rows;
    for (Eigen::Index i = 0, hand = 0; i < scan.points.rows(); ++i)
      if (scan.points(i, 0) < wrist[0] + 0.01 || (every > 0 && hand++ % every == 0)) rows.push_back(i);
    kept.points = scan.points(rows, Eigen::all);
    kept.normals = scan.normals(rows, Eigen::all);
    return kept;
  };
  Pose pose = arm.straight();
  CHECK_FALSE(arm.seat(ScanSurface(keep(0)), pose));
  CHECK(pose.rotations == arm.straight().rotations);

  const std::vector<Pose> others(2, arm.truth.pose);
  CHECK(arm.seat(ScanSurface(keep(40)), pose, others));
  CHECK((pose.rotations - arm.truth.pose.rotations).bottomRows<2>().rowwise().norm().maxCoeff() < 0.3);
}

TEST_CASE("the cost of a part is least in its place, and a descent never ends above its start") {
  const Arm arm;
  const ScanSurface scan(arm.scan());
  const PartFitOptions options;
  const PartFit fit(scan, StandingBody(arm.model, arm.truth), kHand, arm.truth.pose, options);
  REQUIRE(fit.tells());
  CHECK(fit.joints() == std::vector<std::int32_t>{kHand, kFingers});
  const double there = fit.cost(arm.truth.pose);
  for (int axis = 0; axis < 3; ++axis)
    for (const double angle : {-2.0, -0.7, -0.2, 0.2, 0.7, 2.0}) {
      Pose turned = arm.truth.pose;
      turned.rotations(kHand, axis) += angle;
      CAPTURE(axis, angle);
      CHECK(fit.cost(turned) > there);
      const Pose lower = fit.descended(turned);
      CHECK(fit.cost(lower) <= fit.cost(turned));
      if (std::abs(angle) <= 0.2) CHECK(arm.distance(lower) < 0.25 * arm.distance(turned));
    }
}

TEST_CASE("hands keep to the joints' limits") {
  const Arm arm;
  const ScanSurface scan(arm.scan());
  BodyParts parts = arm.model.parts();
  parts.limits = JointLimits{Vertices::Constant(4, 3, -0.5), Vertices::Constant(4, 3, 0.5)};
  const BodyModel stiff(parts);
  Pose pose = arm.straight();
  seatExtremity(scan, stiff, arm.truth.identity, kHand, {}, pose);
  CHECK(pose.rotations.bottomRows<2>().cwiseAbs().maxCoeff() <= 0.5);
}

TEST_CASE("extremities begin where the last limb ends") {
  const std::vector<Limb> limbs = {{1, 2}, {2, 3}, {7, 8}};
  CHECK(extremitiesOf(limbs) == std::vector<std::int32_t>{3, 8});
}

TEST_CASE("seating an extremity stops when asked to, and names options out of range") {
  const Arm arm;
  const ScanSurface scan(arm.scan());
  std::stop_source source;
  source.request_stop();
  Pose pose = arm.straight();
  CHECK_FALSE(arm.seat(scan, pose, {}, source.get_token()));
  CHECK(pose.rotations == arm.straight().rotations);
  ExtremityOptions options;
  options.starts = 0;
  CHECK_THROWS_WITH(seatExtremity(scan, arm.model, arm.truth.identity, kHand, {}, pose, options),
                    Catch::Contains("starts = 0, want >= 1"));
  options = {};
  options.fit.points = 3;
  CHECK_THROWS_WITH(seatExtremity(scan, arm.model, arm.truth.identity, kHand, {}, pose, options),
                    Catch::Contains("fit.points = 3, want >= 20"));
  options.fit = {};
  options.fit.parent_deviation = -1;
  CHECK(options.firstViolation().value().find("fit.parent_deviation") == 0);
}
