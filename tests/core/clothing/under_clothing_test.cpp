#include "core/clothing/under_clothing.h"

#include <catch2/catch.hpp>

#include "core/mesh/quality.h"
#include "core/sample/virtual_scanner.h"
#include "tests/support/bodies.h"

using namespace shaped;
using namespace shaped::test;

namespace {

/// A tube in some poses, in cloth that lies on the skin here in one frame and there in another.
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
      const double wave = std::sin(2 * model.parts().mean(v, 0) + 2.1 * f);
      cloth.row(v) += thickness * (0.55 + 0.45 * wave) * normals.row(v);
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

TEST_CASE("the body under moving cloth lies within it, nearer to the truth than half the cloth") {
  const DressedTube tube(4);
  const auto found = estimateUnderClothing(tube.scans, tube.model, tube.landmarks);
  REQUIRE(found.solution.frames.size() == 4);
  CHECK(tube.error(found.solution) < 0.5 * tube.thickness);
  for (const auto& frame : found.solution.frames) {
    CHECK(frame.inside > 0.75);  // of a turned tube, whose cloth the identity cannot follow everywhere
    CHECK(frame.mean_gap > 0.1 * tube.thickness);
  }
  // Without the cloth's term the body is blown up to the mean of the cloth.
  ClothingOptions plain;
  plain.first.cloth = plain.postures.cloth = plain.refined.cloth = 0;
  const auto blown = estimateUnderClothing(tube.scans, tube.model, tube.landmarks, plain);
  CHECK(tube.error(blown.solution) > tube.error(found.solution));
  CHECK(blown.solution.frames[0].inside < 0.8);
}

TEST_CASE("more frames tell more of what is under the cloth") {
  const DressedTube tube(4);
  const auto all = estimateUnderClothing(tube.scans, tube.model, tube.landmarks).solution;
  const auto one = estimateUnderClothing({tube.scans.data(), 1}, tube.model, {tube.landmarks.data(), 1}).solution;
  const auto misfit = [&](const ClothedBody& found) {
    return meanVertexDistance(tube.model.rest(found.identity), tube.model.rest(tube.identity));
  };
  CHECK(misfit(all) < misfit(one));
}

TEST_CASE("estimating under clothing refuses what it cannot read, and stops when asked to") {
  const DressedTube tube(2);
  CHECK_THROWS_WITH(estimateUnderClothing({}, tube.model, {}), Catch::Contains("scans: is empty"));
  CHECK_THROWS_WITH(estimateUnderClothing(tube.scans, tube.model, {tube.landmarks.data(), 1}),
                    Catch::Contains("landmarks: has 1 lists, want none or one for each of 2 frames"));
  auto broken = tube.scans;
  broken[1].points(5, 0) = NAN;
  CHECK_THROWS_WITH(estimateUnderClothing(broken, tube.model, {}), Catch::Contains("scans[1]"));
  ClothingOptions options;
  options.refined.cloth = -1;
  CHECK_THROWS_WITH(estimateUnderClothing(tube.scans, tube.model, {}, options),
                    Catch::Contains("refined holds a weight"));
  options = {};
  options.retries = 0;  // a frame that was not fitted alone would have no posture
  CHECK_THROWS_WITH(estimateUnderClothing(tube.scans, tube.model, {}, options),
                    Catch::Contains("retries = 0, want >= 1"));
  std::stop_source source;
  source.request_stop();
  options = {};
  options.stop = source.get_token();
  CHECK(estimateUnderClothing(tube.scans, tube.model, tube.landmarks, options).termination == Termination::kCancelled);
}
