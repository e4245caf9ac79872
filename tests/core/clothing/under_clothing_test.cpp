#include "core/clothing/under_clothing.h"

#include <algorithm>
#include <catch2/catch.hpp>

#include "core/mesh/quality.h"
#include "core/sample/virtual_scanner.h"
#include "tests/support/bodies.h"

using namespace shaped;
using namespace shaped::test;

namespace {

/// A tube in some poses, bare at both ends, between them in cloth that lies on the skin here in one frame and there in
/// another.
struct DressedTube {
  BodyModel model = tubeModel(3, 12, 3);
  Eigen::VectorXd identity;
  std::vector<Vertices> bodies;
  std::vector<Scan> scans;
  std::vector<std::vector<Landmark>> landmarks;
  double thickness = 0.08;  ///< m, the thickest

  explicit DressedTube(int frames) {
    identity = 0.6 * randomIdentity(model, 3);
    for (int f = 0; f < frames; ++f) addFrame(f);
  }

  void addFrame(int f) {
    const auto& faces = model.topology()->faces();
    Vertices body = model.posed({identity, randomPose(model.skeleton(), 0.2, unsigned(f))}).vertices();
    const Vertices normals = vertexNormals(faces, body);
    Vertices cloth = body;
    for (Eigen::Index v = 0; v < body.rows(); ++v) {
      const double x = model.parts().mean(v, 0), wave = std::sin(2 * x + 2.1 * f);
      const double covered = std::clamp(2 * (1.6 - std::abs(x)), 0.0, 1.0);
      cloth.row(v) += covered * thickness * (0.55 + 0.45 * wave) * normals.row(v);
    }
    VirtualScannerOptions scanner;
    scanner.ring_radius = 8;
    scanner.above = scanner.below = 4;
    scanner.points = 6000;
    scanner.motion = RigidMotion{};
    scans.push_back(scanVirtually(cloth, faces, scanner).scan);
    landmarks.emplace_back();
    for (std::int32_t face = 0; face < faces.rows(); face += 61) {
      Landmark landmark{{face, Eigen::Vector3d::Constant(1.0 / 3), Eigen::Vector3d::Zero()}, Eigen::Vector3d::Zero()};
      landmark.position = position(landmark.anchor, faces, body);
      landmarks.back().push_back(landmark);
    }
    bodies.push_back(std::move(body));
  }

  double error(const ClothedBody& found) const {
    double sum = 0;
    for (std::size_t f = 0; f < bodies.size(); ++f)
      sum += meanVertexDistance(model.posed({found.identity, found.frames[f].pose}).vertices(), bodies[f]);
    return sum / double(bodies.size());
  }
};

}  // namespace

double meanInside(const ClothedBody& found) {
  double sum = 0;
  for (const auto& frame : found.frames) sum += frame.inside;
  return sum / double(found.frames.size());
}

TEST_CASE("the body under moving cloth lies within it, nearer to the truth than half the cloth") {
  const DressedTube tube(4);
  const auto found = estimateUnderClothing(tube.scans, tube.model, tube.landmarks).solution;
  REQUIRE(found.frames.size() == 4);
  CAPTURE(tube.error(found), meanInside(found));
  CHECK(tube.error(found) < 0.25 * tube.thickness);
  CHECK(meanInside(found) >= 0.95);
  for (const auto& frame : found.frames) {
    CHECK(frame.inside > 0.9);  // three modes cannot follow the cloth everywhere
    CHECK(frame.inside_strictly <= frame.inside);
    CHECK(frame.mean_gap > 0.1 * tube.thickness);
    CHECK(frame.trusted);
  }
  // Without the cloth's term more of it stands outside.
  ClothingOptions plain;
  plain.first.cloth = plain.last.cloth = 0;
  CHECK(meanInside(estimateUnderClothing(tube.scans, tube.model, tube.landmarks, plain).solution) < meanInside(found));
}

// Known gap: on this tube, whose landmarks lie on the true body, one frame finds the identity better (4.9 mm) than four
// do (8.2 mm), with other values of tight_spread too (0.008 and 0.03: 6.8 and 6.3 mm). Without the identity's last step
// alone, postures held, four do better than one; but then it never comes to rest.
TEST_CASE("more frames tell more of what is under the cloth", "[!shouldfail]") {
  const DressedTube tube(4);
  const auto misfit = [&](std::size_t frames) {
    const auto found = estimateUnderClothing({tube.scans.data(), frames}, tube.model, {tube.landmarks.data(), frames});
    return meanVertexDistance(tube.model.rest(found.solution.identity), tube.model.rest(tube.identity));
  };
  CHECK(misfit(4) < misfit(1));
}

TEST_CASE("where only some postures move with the identity, the others still count") {
  const DressedTube tube(4);
  ClothingOptions options;
  options.together = 2;
  const auto found = estimateUnderClothing(tube.scans, tube.model, tube.landmarks, options).solution;
  CHECK(tube.error(found) < 0.25 * tube.thickness);
  CHECK(meanInside(found) >= 0.95);
}

TEST_CASE("estimating under clothing refuses what it cannot read, and stops when asked to") {
  const DressedTube tube(2);
  CHECK_THROWS_WITH(estimateUnderClothing({}, tube.model, {}), Catch::Contains("scans: is empty"));
  CHECK_THROWS_WITH(estimateUnderClothing(tube.scans, tube.model, {tube.landmarks.data(), 1}),
                    Catch::Contains("landmarks: has 1 lists, want none or one for each of 2 frames"));
  auto broken = tube.scans;
  broken[1].points(5, 0) = NAN;
  CHECK_THROWS_WITH(estimateUnderClothing(broken, tube.model, {}), Catch::Contains("scans[1]"));
  auto strayed = tube.landmarks;
  strayed[1][2].anchor.face = 1 << 20;
  CHECK_THROWS_WITH(estimateUnderClothing(tube.scans, tube.model, strayed),
                    Catch::Contains("landmarks[1][2]: is on face 1048576"));
  ClothingOptions options;
  options.last.cloth = -1;
  CHECK_THROWS_WITH(estimateUnderClothing(tube.scans, tube.model, {}, options), Catch::Contains("last holds a weight"));
  options = {};
  options.retries = 0;  // a frame that was not fitted alone would have no posture
  CHECK_THROWS_WITH(estimateUnderClothing(tube.scans, tube.model, {}, options),
                    Catch::Contains("retries = 0, want >= 1"));
  options = {};
  options.together = 0;
  CHECK_THROWS_WITH(estimateUnderClothing(tube.scans, tube.model, {}, options),
                    Catch::Contains("together = 0, want >= 1"));
  options = {};
  options.extremities.fit.rounds = 0;
  CHECK_THROWS_WITH(estimateUnderClothing(tube.scans, tube.model, {}, options),
                    Catch::Contains("extremities.fit.rounds = 0, want >= 1"));
  std::stop_source source;
  source.request_stop();
  options = {};
  options.stop = source.get_token();
  CHECK(estimateUnderClothing(tube.scans, tube.model, tube.landmarks, options).termination == Termination::kCancelled);
}

TEST_CASE("an estimate under clothing that is stopped at any stage begins no other and gives nothing") {
  const DressedTube tube(3);
  for (const std::string stage : {"first fit 1", "limbs of frame 1", "pass 2"}) {
    std::stop_source source;
    std::vector<std::string> told;
    ClothingOptions options;
    options.stop = source.get_token();
    options.progress = [&](const Progress& progress) {
      told.push_back(progress.stage);
      if (progress.stage == stage) source.request_stop();
    };
    const auto found = estimateUnderClothing(tube.scans, tube.model, tube.landmarks, options);
    INFO(stage);
    CHECK(found.termination == Termination::kCancelled);
    CHECK((found.solution.frames.empty() && found.solution.identity.size() == 0));
    CHECK(told.back() == stage);
  }
}
