#include "core/registration/scan_to_model.h"

#include <catch2/catch.hpp>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/registration/scan_registration.h"
#include "core/sample/virtual_scanner.h"
#include "tests/support/bodies.h"

using namespace shaped;
using namespace shaped::test;

namespace {

/// A tube of some identity in some pose, scanned by a ring of cameras.
struct ScannedTube {
  BodyModel model;
  BodyState truth;
  Vertices surface;
  VirtualScan scanned;
};

ScannedTube scannedTube(const VirtualScannerOptions& options, double bend = 0.25) {
  BodyModel model = tubeModel(4, 12, 3);
  BodyState truth{0.7 * randomIdentity(model, 2), randomPose(model.skeleton(), bend, 3)};
  const Vertices surface = model.posed(truth).vertices();
  auto scanned = scanVirtually(surface, model.topology()->faces(), options);
  Vertices placed = apply(scanned.motion, surface);
  return {std::move(model), truth, std::move(placed), std::move(scanned)};
}

VirtualScannerOptions ring() {
  VirtualScannerOptions options;
  options.ring_radius = 8;
  options.above = 4;
  options.below = 4;
  options.points = 6000;
  return options;
}

/// As for bodies of two metres.
ModelFitOptions fitOptions() {
  ModelFitOptions options;
  options.levels.back().points = 4000;
  return options;
}

}  // namespace

TEST_CASE("identity and pose are found on a scan, from a rough start, to the noise") {
  VirtualScannerOptions scanner = ring();
  scanner.motion = RigidMotion{};
  const auto tube = scannedTube(scanner);
  const ScanSurface surface(tube.scanned.scan);
  const auto fit = fitModelToScan(surface, tube.model, tube.model.meanState(), {}, fitOptions());
  const Vertices fitted = tube.model.posed(fit.solution.state).vertices();
  // The tube is round: a turn about its own axis leaves the scan alone, so distances to the surface are looked at.
  CHECK(distancesToSurface(fitted, tube.surface, tube.model.topology()->faces()).mean() < 3e-3);
  CHECK(fit.solution.report.explained > 0.97);
  CHECK(fit.solution.report.scan_median < 3e-3);
  REQUIRE(fit.solution.report.regions.size() >= 4);
  const double rough = distancesToSurface(tube.model.parts().mean, tube.surface, tube.model.topology()->faces()).mean();
  CHECK(rough > 0.02);  // the start was rough
}

TEST_CASE("stray points draw a model aside where the loss is not robust") {
  VirtualScannerOptions scanner = ring();
  scanner.motion = RigidMotion{};
  const auto tube = scannedTube(scanner);
  // A film above one side: of every third point there, a copy four centimetres off the surface.
  Scan scan = tube.scanned.scan;
  for (Eigen::Index i = 0; i < scan.points.rows(); i += 3)
    if (scan.normals(i, 1) > 0.3) scan.points.row(i) += 0.04 * scan.normals.row(i);
  const ScanSurface surface(scan);
  const auto error = [&](double loss_scale) {
    auto options = fitOptions();
    for (auto& level : options.levels) level.loss_scale = std::max(level.loss_scale, loss_scale);
    const auto fit = fitModelToScan(surface, tube.model, tube.model.meanState(), {}, options);
    return distancesToSurface(tube.model.posed(fit.solution.state).vertices(), tube.surface,
                              tube.model.topology()->faces())
        .mean();
  };
  const double robust = error(0);
  CHECK(robust < 7e-3);
  CHECK(error(100) > 1.5 * robust);
}

TEST_CASE("landmarks say what the surface leaves open") {
  VirtualScannerOptions scanner = ring();
  scanner.motion = RigidMotion{};
  const auto tube = scannedTube(scanner, 0.1);
  const ScanSurface surface(tube.scanned.scan);
  const auto& faces = tube.model.topology()->faces();
  std::vector<Landmark> landmarks;
  for (std::int32_t face = 0; face < faces.rows(); face += 37) {
    Landmark landmark{{face, Eigen::Vector3d::Constant(1.0 / 3), Eigen::Vector3d::Zero()}, Eigen::Vector3d::Zero()};
    landmark.position = position(landmark.anchor, faces, tube.surface);
    landmarks.push_back(landmark);
  }
  const auto error = [&](const std::vector<Landmark>& known) {
    const auto fit = fitModelToScan(surface, tube.model, tube.model.meanState(), known, fitOptions());
    return meanVertexDistance(tube.model.posed(fit.solution.state).vertices(), tube.surface);
  };
  CHECK(error(landmarks) < 0.005);
  CHECK(error({}) > 2 * error(landmarks));  // turned about the tube's own axis
}

TEST_CASE("a scan far from the model stalls and says so") {
  VirtualScannerOptions scanner = ring();
  scanner.motion = RigidMotion{Eigen::Matrix3d::Identity(), Eigen::Vector3d(50, 0, 0)};
  const auto tube = scannedTube(scanner);
  const auto fit = fitModelToScan(ScanSurface(tube.scanned.scan), tube.model, tube.model.meanState(), {});
  CHECK(fit.termination == Termination::kStalled);
  CHECK(fit.solution.report.explained == 0);
  CHECK(fit.solution.report.seen == 0);
  CHECK(fit.solution.state.identity.norm() == 0);
}

TEST_CASE("registering places a scan by itself, whatever its placement") {
  VirtualScannerOptions scanner = ring();
  scanner.any_rotation = true;
  for (const std::uint64_t seed : {1, 2, 3}) {
    scanner.seed = seed;
    const auto tube = scannedTube(scanner);
    const auto result = registerScan(tube.scanned.scan, tube.model, {});
    // Of a tube four metres long whose ends look alike.
    CHECK(distancesToSurface(result.solution.vertices, tube.surface, tube.model.topology()->faces()).mean() < 0.01);
    CHECK(result.solution.score > 0.95);
    CHECK(result.solution.warnings.empty());
  }
}

TEST_CASE("refining brings a surface nearer to a scan than the model can") {
  VirtualScannerOptions scanner = ring();
  scanner.points = 15000;
  const auto tube = scannedTube(scanner);
  ScanRegistrationOptions options;
  const BodyModel poor = tube.model.truncated(1);
  const auto distance = [&](const Vertices& vertices) {
    return distancesToSurface(vertices, tube.surface, tube.model.topology()->faces()).mean();
  };
  const double model = distance(registerScan(tube.scanned.scan, poor, {}, options).solution.vertices);
  options.refine = true;
  const auto refined = registerScan(tube.scanned.scan, poor, {}, options);
  REQUIRE(refined.solution.refinement);
  CHECK(distance(refined.solution.vertices) < 0.5 * model);
  CHECK(refined.solution.refinement->flipped == 0);
}

TEST_CASE("registering reports what is wrong with a scan") {
  VirtualScannerOptions scanner = ring();
  auto tube = scannedTube(scanner);
  const auto& scan = tube.scanned.scan;

  Scan inside_out = flipped(scan);
  CHECK(pointsInwards(inside_out));
  CHECK_FALSE(pointsInwards(scan));
  const auto turned = registerScan(inside_out, tube.model, {}).solution;
  CHECK(turned.flipped_normals);
  CHECK(turned.score > 0.95);
  REQUIRE(turned.warnings.size() == 1);
  CHECK_THAT(turned.warnings[0], Catch::Contains("normals pointed inwards"));

  Scan millimetres = scan;
  millimetres.points *= 1000;
  ScanRegistrationOptions options;
  options.fit.levels.resize(1);
  const auto large = registerScan(millimetres, tube.model, {}, options).solution;
  REQUIRE(large.suspected_unit_factor);
  CHECK(*large.suspected_unit_factor == Approx(0.001));
  CHECK(large.score < 0.1);
  REQUIRE(large.warnings.size() >= 2);
  CHECK_THAT(large.warnings[0], Catch::Contains("of the scan lies on the registered surface"));
  CHECK_THAT(large.warnings[1], Catch::Contains("about 1000 times the model's size"));
  options = {};
  options.unit_factor = 0.001;
  CHECK(registerScan(millimetres, tube.model, {}, options).solution.score > 0.95);

  CHECK_THROWS_WITH(registerScan({}, tube.model, {}), Catch::Contains("scan"));
  Scan few{scan.points.topRows(50), scan.normals.topRows(50), {}};
  CHECK_THROWS_WITH(registerScan(few, tube.model, {}), Catch::Contains("50"));
  Scan broken = scan;
  broken.points(7, 1) = NAN;
  CHECK_THROWS_WITH(registerScan(broken, tube.model, {}), Catch::Contains("7"));
  options.unit_factor = 0;
  CHECK_THROWS_WITH(registerScan(scan, tube.model, {}, options), Catch::Contains("unit_factor = 0"));
  Landmark nowhere;
  nowhere.anchor.face = 100000;
  CHECK_THROWS_WITH(registerScan(scan, tube.model, {nowhere}), Catch::Contains("landmarks[0]"));
}
