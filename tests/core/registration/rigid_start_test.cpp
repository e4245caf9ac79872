#include "core/registration/rigid_start.h"

#include <catch2/catch.hpp>
#include <random>

#include "core/numerics/error.h"
#include "core/registration/rotation_cover.h"
#include "tests/core/registration/scanned_shapes.h"

using namespace shaped;
using namespace shaped::test;
using Catch::Matchers::Contains;

namespace {

double degrees(double radians) { return radians * 180 / M_PI; }

double rotationError(const RigidStart& start, const RigidMotion& truth) {
  return degrees(angleBetween(start.motion.rotation, truth.rotation));
}

Solved<RigidStart> place(const Scan& scan, const Mesh& mesh, const RigidStartOptions& options = {}) {
  return startRigidly(ScanSurface(scan), mesh.vertices, mesh.topology->faces(), options);
}

}  // namespace

TEST_CASE("the icosahedron's rotations are 60, form a group and leave no rotation further than 45 degrees") {
  const auto rotations = icosahedralRotations();
  REQUIRE(rotations.size() == 60);
  const auto nearest = [&](const Eigen::Matrix3d& rotation) {
    double angle = 10;
    for (const auto& one : rotations) angle = std::min(angle, angleBetween(one, rotation));
    return degrees(angle);
  };
  for (const auto& one : rotations) {
    CHECK(one.determinant() == Approx(1));
    CHECK(nearest(one * rotations[17]) < 1e-5);
  }
  for (int axis = 0; axis < 3; ++axis)
    CHECK(nearest(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::Unit(axis)).toRotationMatrix()) < 1e-5);
  double furthest = 0;
  for (unsigned seed = 0; seed < 2000; ++seed) furthest = std::max(furthest, nearest(randomMotion(seed).rotation));
  CHECK(furthest < 45);
  CHECK(furthest > 35);
}

TEST_CASE("a scan of the template itself is placed, whatever its rotation, with holes and stray points") {
  const Mesh mesh = hook();
  for (unsigned seed = 0; seed < 6; ++seed) {
    const RigidMotion truth = randomMotion(seed);
    Scan scan = scanPoints(mesh, 5000);
    if (seed % 3 == 1) scan = kept(scan, [&](const auto& p) { return p[0] > -0.7; });
    if (seed % 3 == 2) scan = withStrayPoints(scan, 20, 0.3, seed);
    if (seed % 2) scan.normals.resize(0, 3);
    const auto solved = place(moved(scan, truth), mesh);
    CHECK(solved.converged());
    CHECK(rotationError(solved.solution, truth) < 3);
    CHECK((solved.solution.motion.translation - truth.translation).norm() < 0.1);
    CHECK(solved.solution.margin > 0.3);
    CHECK(degrees(angleBetween(solved.solution.motion.rotation, solved.solution.runner_up.rotation)) > 30);
  }
}

TEST_CASE("a scan of another size is placed, and the scale is told apart from the motion") {
  const Mesh mesh = hook();
  const RigidMotion truth = randomMotion(11);
  Scan scan = scanPoints(mesh, 4000);
  scan.points *= 1.3;
  const auto solved = place(moved(scan, truth), mesh);
  CHECK(rotationError(solved.solution, truth) < 2);
  CHECK(solved.solution.similarity.scale == Approx(1.3).epsilon(0.02));
  CHECK(solved.solution.motion.rotation.determinant() == Approx(1));
  CHECK(place(moved(scan, truth), mesh, {.largest_scale = 1.1}).solution.similarity.scale <= 1.1 + 1e-12);
}

TEST_CASE("the placement turns with the scan and is the same each time") {
  const Mesh mesh = hook();
  const Scan scan = scanPoints(mesh, 3000);
  const RigidMotion turn = randomMotion(5);
  const auto one = place(scan, mesh), again = place(scan, mesh), turned = place(moved(scan, turn), mesh);
  CHECK(one.solution.motion.rotation == again.solution.motion.rotation);
  CHECK(degrees(angleBetween(turn.rotation * one.solution.motion.rotation, turned.solution.motion.rotation)) < 0.05);
}

TEST_CASE("a shape with symmetries is placed with a margin that says so") {
  const Mesh mesh = tube(30, 24);
  const auto solved = place(moved(scanPoints(mesh, 3000), randomMotion(2)), mesh);
  CHECK(solved.solution.margin < 0.1);
  const Mesh lopsided = hook();
  CHECK(place(scanPoints(lopsided, 3000), lopsided).solution.margin > 5 * solved.solution.margin);
}

TEST_CASE("landmarks place the template alone") {
  const Mesh mesh = hook();
  const RigidMotion truth = randomMotion(8);
  std::vector<Landmark> landmarks;
  for (const std::int32_t face : {3, 400, 900, 1500}) {
    const Anchor anchor{face, {0.2, 0.3, 0.5}, {0, 0, 0.01}};
    const Eigen::Vector3d at = position(anchor, mesh.topology->faces(), mesh.vertices);
    landmarks.push_back({anchor, truth.rotation * at + truth.translation, 1});
  }
  landmarks.push_back(landmarks.front());
  landmarks.back().position.setConstant(100);
  landmarks.back().weight = 0;  // does not count
  const auto solved = startFromLandmarks(landmarks, mesh.vertices, mesh.topology->faces());
  CHECK(rotationError(solved.solution, truth) < 1e-6);
  CHECK(solved.solution.score < 1e-12);
  landmarks.resize(2);
  CHECK_THROWS_WITH(startFromLandmarks(landmarks, mesh.vertices, mesh.topology->faces()), Contains("want at least 3"));
  landmarks.push_back(landmarks.front());
  CHECK_THROWS_WITH(startFromLandmarks(landmarks, mesh.vertices, mesh.topology->faces()), Contains("on one line"));
}

TEST_CASE("a rigid start that is stopped or cut short says so, and options out of range are named") {
  const Mesh mesh = hook();
  const ScanSurface scan(scanPoints(mesh, 2000));
  std::stop_source stop;
  stop.request_stop();
  CHECK(startRigidly(scan, mesh.vertices, mesh.topology->faces(), {}, stop.get_token()).termination ==
        Termination::kCancelled);
  RigidStartOptions options;
  options.fine_steps = 1;
  options.tolerance = 1e-14;
  CHECK(startRigidly(scan, mesh.vertices, mesh.topology->faces(), options).termination == Termination::kIterationLimit);
  options = {};
  options.samples = 10;
  CHECK_THROWS_WITH(startRigidly(scan, mesh.vertices, mesh.topology->faces(), options),
                    Contains("samples = 10, want >= 50"));
}

TEST_CASE("body scans are placed the right way round") {
  const auto body = meanBody();
  if (!body) return;
  double worst = 0;
  for (const int number : {0, 5, 12, 15, 25}) {
    const BodyScan scan = bodyScan(number);
    const auto solved = place(scan.scan, *body);
    worst = std::max(worst, rotationError(solved.solution, alignRigidly(body->vertices, scan.truth)));
    CHECK(solved.solution.margin > 0.1);
  }
  CHECK(worst < 15);
}
