#include "core/registration/field_deformation.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/registration/scan_registration.h"
#include "core/registration/surface_samples.h"
#include "tests/support/bodies.h"
#include "tests/support/fields.h"

using namespace shaped;
using namespace shaped::test;

namespace {

/// A tube in a pose, and points of its surface with their normals.
struct PosedTube {
  BodyModel model = tubeModel(4, 12, 3);
  BodyState state{0.7 * randomIdentity(model, 2), randomPose(model.skeleton(), 0.25, 3)};
  Vertices surface = model.posed(state).vertices();
  const Faces& faces = model.topology()->faces();
  Vertices rest = model.rest(state.identity);

  Scan scan(int points) const {
    const auto samples = sampleByArea(faces, surface, points);
    return {samples.points, samples.normals, {}};
  }
  std::shared_ptr<const FieldReference> reference() const {
    return std::make_shared<const FieldReference>(*makeFieldReference(model.topology(), model.parts().mean));
  }
};

JacobianFieldWeights randomField(const FieldScaling& scaling) {
  auto weights = constantField(scaling);
  std::srand(7);
  for (auto* net : {&weights.source_net, &weights.scan_net, &weights.mlp})
    for (auto& layer : *net) layer.weight = 0.01F * Eigen::MatrixXf::Random(layer.weight.rows(), layer.weight.cols());
  return weights;
}

/// A state that a rigid motion has carried.
BodyState turned(const BodyModel& model, const BodyState& state, double angle) {
  const RigidMotion motion{Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix(),
                           Eigen::Vector3d(0.3, -2, 1)};
  return carried(model, state, motion);
}

}  // namespace

TEST_CASE("points of a posed surface come to rest on the surface at rest, with its normals") {
  const PosedTube tube;
  const Scan scan = tube.scan(3000);
  const Scan rest = scanAtRest(tube.model, tube.state, ScanSurface(scan));
  REQUIRE(rest.points.rows() == 3000);
  const auto expected = sampleByArea(tube.faces, tube.surface, 3000);
  // The same places of the same triangles, found anew: the mean of corners at rest.
  const ClosestPointQuery posed(tube.surface, tube.faces);
  const Vertices normals = faceNormals(tube.faces, tube.rest);
  for (Eigen::Index i = 0; i < 3000; i += 7) {
    const auto place = posed(expected.points.row(i));
    Eigen::RowVector3d there = Eigen::RowVector3d::Zero();
    for (int c = 0; c < 3; ++c) there += place.barycentric[c] * tube.rest.row(tube.faces(place.face, c));
    CHECK((rest.points.row(i) - there).norm() < 1e-9);
    CHECK(rest.normals.row(i).dot(normals.row(place.face)) > 0.93);  // a tilt of the blend
  }
  CHECK(rest.faces.rows() == 0);
}

TEST_CASE("a point beside the surface keeps its distance on the way back where only one bone has it") {
  const PosedTube tube;
  const BodyState straight = turned(tube.model, {tube.state.identity, restPose(tube.model.skeleton())}, 2);
  const Vertices surface = tube.model.posed(straight).vertices();
  const auto samples = sampleByArea(tube.faces, surface, 500);
  const Scan scan{samples.points + 0.03 * samples.normals, samples.normals, {}};
  const Scan rest = scanAtRest(tube.model, straight, ScanSurface(scan));
  REQUIRE(rest.points.rows() == 500);
  const auto before = distancesToSurface(scan.points, surface, tube.faces);
  const auto after = distancesToSurface(rest.points, tube.rest, tube.faces);
  CHECK((before - after).cwiseAbs().maxCoeff() < 1e-9);
}

TEST_CASE("what is far from the surface, or of another sheet, is left out; dense scans are thinned") {
  const PosedTube tube;
  Scan scan = tube.scan(3000);
  for (Eigen::Index i = 0; i < 3000; i += 3) scan.points.row(i) += 0.3 * scan.normals.row(i);
  for (Eigen::Index i = 1; i < 3000; i += 3) scan.normals.row(i) *= -1;
  const ScanSurface surface(scan);
  const Scan rest = scanAtRest(tube.model, tube.state, surface);
  CHECK(rest.points.rows() == 1000);
  CHECK(rest.normals.rows() == 1000);
  CHECK(scanAtRest(tube.model, tube.state, surface, {.max_distance = 1}).points.rows() > 1900);
  CHECK(scanAtRest(tube.model, tube.state, surface, {.max_normal_angle = 180}).points.rows() == 2000);
  CHECK(scanAtRest(tube.model, tube.state, ScanSurface(tube.scan(3000)), {.points = 700}).points.rows() == 700);

  CHECK_THROWS_WITH(scanAtRest(tube.model, tube.state, surface, {.max_distance = 0}), Catch::Contains("max_distance"));
  CHECK_THROWS_WITH(scanAtRest(tube.model, tube.state, surface, {.max_normal_angle = 0}),
                    Catch::Contains("max_normal_angle"));
  CHECK_THROWS_WITH(scanAtRest(tube.model, tube.state, surface, {.points = 0}), Catch::Contains("points"));
}

TEST_CASE("normals that were estimated point outwards at rest") {
  const PosedTube tube;
  Scan scan = tube.scan(4000);
  scan.normals.resize(0, 3);
  const Scan rest = scanAtRest(tube.model, tube.state, ScanSurface(scan));
  REQUIRE(rest.points.rows() > 3500);
  const ClosestPointQuery closest(tube.rest, tube.faces);
  const Vertices normals = faceNormals(tube.faces, tube.rest);
  for (Eigen::Index i = 0; i < rest.points.rows(); ++i)
    CHECK(rest.normals.row(i).dot(normals.row(closest(rest.points.row(i)).face)) > 0);
}

TEST_CASE("a field of zeros leaves the model's surface as it is") {
  const PosedTube tube;
  const auto reference = tube.reference();
  const FieldDeformation field(reference, constantField(scalingOf(*reference)));
  const auto deformed = field.deform(tube.model, tube.state, ScanSurface(tube.scan(2000)));
  REQUIRE(deformed);
  CHECK(maxVertexDistance(deformed->rest, tube.rest) < 1e-9);
  CHECK(maxVertexDistance(deformed->posed, tube.surface) < 1e-3);  // the pose is fitted anew
}

TEST_CASE("a field's surface is what its parts give one after another") {
  const PosedTube tube;
  const auto reference = tube.reference();
  const auto weights = randomField(scalingOf(*reference));
  const ScanSurface scan(tube.scan(2000));
  const auto deformed = FieldDeformation(reference, weights).deform(tube.model, tube.state, scan);
  REQUIRE(deformed);
  const auto features =
      jacobianFieldFeatures(*reference, tube.rest, scanAtRest(tube.model, tube.state, scan), weights.scaling);
  const Vertices rest =
      reference->poisson->solve(JacobianField(weights).predict(features), reference->poisson->centroids(tube.rest));
  CHECK(maxVertexDistance(rest, tube.rest) > 1e-4);
  CHECK(deformed->rest == rest);
  const auto& parts = tube.model.parts();
  const Rig rig{tube.model.skeleton(), parts.regressor * rest, parts.weights, {}};
  CHECK(deformed->posed == skinned(rig, rest, deformed->pose));
  const auto made = FieldDeformation::make(tube.model, weights);
  REQUIRE(made);
  CHECK(made->deform(tube.model, tube.state, scan)->rest == rest);
}

TEST_CASE("a field's regression goes first, and the pose of what comes out is fitted to the scan") {
  const PosedTube tube;
  const auto reference = tube.reference();
  auto weights = constantField(scalingOf(*reference));
  const BodyModel poor = tube.model.truncated(1);
  const BodyState fit{tube.state.identity.head(1), tube.state.pose};
  const Vertices lacking = tube.rest - poor.rest(fit.identity);
  const auto vertices = tube.rest.rows();
  weights.regression = ResidualRegressionWeights{
      Eigen::MatrixXf::Zero(vertices, 1), Eigen::MatrixXf::Zero(1 + 3 * (fit.pose.rotations.rows() - 1), 1),
      Eigen::Map<const Eigen::VectorXd>(lacking.data(), lacking.size()).cast<float>(),
      Eigen::MatrixXf::Zero(3 * vertices, 1)};
  const ScanSurface scan(tube.scan(4000));
  const auto deformed = FieldDeformation(reference, weights).deform(poor, fit, scan);
  REQUIRE(deformed);
  CHECK(meanVertexDistance(poor.rest(fit.identity), tube.rest) > 1e-2);
  CHECK(maxVertexDistance(deformed->rest, tube.rest) < 1e-6);
  CHECK(maxVertexDistance(deformed->posed, tube.surface) < 2e-3);
}

TEST_CASE("with a prior, what a scan shows of a body that no identity says is smoothed over its surface") {
  const PosedTube tube;
  const auto reference = tube.reference();
  auto weights = constantField(scalingOf(*reference));
  weights.smoothness = SmoothPrior{0.3, 1e-3};
  const BodyModel poor = tube.model.truncated(1);
  const BodyState fit{tube.state.identity.head(1), tube.state.pose};
  const ScanSurface scan(tube.scan(4000));
  const FieldDeformation field(reference, weights);
  const auto deformed = field.deform(poor, fit, scan);
  REQUIRE(deformed);
  const Vertices rest = poor.rest(fit.identity);
  CHECK(deformed->rest ==
        rest + smoothDisplacements(*reference, *weights.smoothness, rest, scanAtRest(poor, fit, scan)));
  const auto off = [&](const Vertices& shape) { return distancesToSurface(shape, tube.rest, tube.faces).mean(); };
  CHECK(off(deformed->rest) < 0.4 * off(rest));
  CHECK(distancesToSurface(deformed->posed, tube.surface, tube.faces).mean() <
        0.4 * distancesToSurface(poor.posed(fit).vertices(), tube.surface, tube.faces).mean());

  // The field sees what the prior has made.
  auto both = randomField(weights.scaling);
  both.smoothness = weights.smoothness;
  const auto features = jacobianFieldFeatures(*reference, deformed->rest, scanAtRest(poor, fit, scan), both.scaling);
  const Vertices expected = reference->poisson->solve(JacobianField(both).predict(features), features.centroids);
  CHECK(FieldDeformation(reference, both).deform(poor, fit, scan)->rest == expected);

  weights.smoothness->noise = -1;
  CHECK_THROWS_WITH(FieldDeformation(reference, weights), Catch::Contains("noise"));
}

TEST_CASE("what a field makes of a body at rest does not depend on where its scan lies") {
  const PosedTube tube;
  const auto reference = tube.reference();
  const Eigen::Matrix3d longer = Eigen::Vector3d(0.02, -0.01, 0.005).asDiagonal();
  const FieldDeformation field(reference, constantField(scalingOf(*reference), longer));
  const Scan scan = tube.scan(2000);
  const auto deformed = field.deform(tube.model, tube.state, ScanSurface(scan));
  REQUIRE(deformed);
  CHECK(maxVertexDistance(deformed->rest, tube.rest) > 0.01);
  const BodyState moved = turned(tube.model, tube.state, 2.5);
  const RigidMotion motion = alignRigidly(tube.surface, tube.model.posed(moved).vertices());
  const Scan moved_scan{apply(motion, scan.points), scan.normals * motion.rotation.transpose(), {}};
  const auto again = field.deform(tube.model, moved, ScanSurface(moved_scan));
  REQUIRE(again);
  CHECK(maxVertexDistance(again->rest, deformed->rest) < 1e-6);
}

TEST_CASE("a field needs points of the scan, and a model of its topology") {
  const PosedTube tube;
  const auto reference = tube.reference();
  const FieldDeformation field(reference, constantField(scalingOf(*reference)));
  Scan elsewhere = tube.scan(2000);
  elsewhere.points.array() += 5;
  CHECK_FALSE(field.deform(tube.model, tube.state, ScanSurface(elsewhere)));
  auto overflowing = randomField(field.weights().scaling);
  overflowing.mlp[0].weight.setConstant(3e38F);
  CHECK_FALSE(FieldDeformation(reference, overflowing).deform(tube.model, tube.state, ScanSurface(tube.scan(2000))));
  BodyParts parts = tube.model.parts();
  parts.topology =
      std::make_shared<const Topology>(parts.topology->vertexCount(), Faces(tube.faces.colwise().reverse()));
  const BodyModel other(parts);
  CHECK_THROWS_WITH(field.deform(other, tube.state, ScanSurface(elsewhere)), Catch::Contains("topology"));
  std::stop_source stop;
  stop.request_stop();
  CHECK_FALSE(FieldDeformation::make(tube.model, field.weights(), stop.get_token()));
}

TEST_CASE("registering deforms the fit by the model's field, and says what came of it") {
  const PosedTube tube;
  const auto reference = tube.reference();
  const auto scaling = scalingOf(*reference);
  const BodyModel poor = tube.model.truncated(1);  // what is scanned needs three modes
  const BodyState start{Eigen::VectorXd::Zero(1), tube.state.pose};
  const Vertices& truth = tube.surface;
  const Scan scan = tube.scan(20000);
  ScanRegistrationOptions options;
  const auto plain = registerScanFrom(scan, poor, start, {}, options).solution;
  CHECK_FALSE(plain.field);
  options.field = std::make_shared<const FieldDeformation>(reference, pullField(scaling, 1));
  const auto solved = registerScanFrom(scan, poor, start, {}, options);
  const auto& deformed = solved.solution;
  REQUIRE(deformed.field);
  CHECK(deformed.report.chamfer == plain.report.chamfer);
  CHECK(deformed.field->report.chamfer < 0.8 * plain.report.chamfer);
  CHECK(distancesToSurface(deformed.vertices, truth, tube.faces).mean() <
        0.5 * distancesToSurface(plain.vertices, truth, tube.faces).mean());
  CHECK(deformed.state.identity == plain.state.identity);

  options.field = std::make_shared<const FieldDeformation>(reference, pullField(scaling, -1));
  const auto worse = registerScanFrom(scan, poor, start, {}, options).solution;
  REQUIRE(worse.warnings.size() >= 1);
  CHECK_THAT(worse.warnings.back(), Catch::Contains("field brought the surface no nearer"));

  Scan far = scan;
  far.points.array() += 50;
  const auto stalled = registerScanFrom(far, poor, start, {}, options);
  CHECK(stalled.termination == Termination::kStalled);
  CHECK_FALSE(stalled.solution.field);
  CHECK_THAT(stalled.solution.warnings.back(), Catch::Contains("field deformed nothing"));
}
