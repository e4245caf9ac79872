#include "core/body/body_model.h"

#include <catch2/catch.hpp>

#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "tests/support/bodies.h"

using namespace shaped;
using namespace shaped::test;

TEST_CASE("a body model spans its training set, and coefficients are standard deviations") {
  const auto reference = tubeTemplate(4);
  const auto shapes = tubeIdentities(reference, 12, 1);
  BodyTrainingOptions options;
  options.posture = PostureNormalisation::kNone;
  options.explained = 1 - 1e-12;
  const auto trained = trainBody(reference, shapes, options);
  REQUIRE(trained);
  const auto& model = trained->model;
  Eigen::MatrixXd coefficients(model.modeCount(), 12);
  for (int i = 0; i < 12; ++i) {
    const Vertices placed = apply(alignRigidly(shapes[std::size_t(i)], model.parts().mean), shapes[std::size_t(i)]);
    coefficients.col(i) = model.identityOf(placed);
    CHECK(maxVertexDistance(model.rest(coefficients.col(i)), placed) < 1e-4);
  }
  // The leading modes are of unit variance over the training set.
  for (int m = 0; m < 3; ++m) CHECK(coefficients.row(m).squaredNorm() / 12 == Approx(1).epsilon(1e-3));
  CHECK((model.parts().modes.transpose() * model.parts().modes -
         Eigen::MatrixXd::Identity(model.modeCount(), model.modeCount()))
            .norm() < 1e-9);
}

TEST_CASE("a posed body is its identity skinned about its own joints") {
  const auto model = tubeModel(4, 10, 3);
  const BodyState state{randomIdentity(model, 2), randomPose(model.skeleton(), 1, 3)};
  const Rig rig{model.skeleton(), model.parts().regressor * model.rest(state.identity), model.parts().weights, {}};
  CHECK(maxVertexDistance(model.posed(state).vertices(), skinned(rig, model.rest(state.identity), state.pose)) < 1e-12);
  CHECK((model.restJoints(state.identity) - rig.rest_joints).cwiseAbs().maxCoeff() < 1e-12);
  CHECK(maxVertexDistance(model.posed(model.meanState()).vertices(), model.parts().mean) < 1e-14);
}

TEST_CASE("a truncated model keeps its leading modes") {
  const auto model = tubeModel(3, 10, 4);
  const auto small = model.truncated(2);
  CHECK(small.modeCount() == 2);
  Eigen::VectorXd identity(4);
  identity << 0.5, -1, 0, 0;
  CHECK(maxVertexDistance(small.rest(identity.head(2)), model.rest(identity)) < 1e-14);
  CHECK_THROWS_WITH(model.truncated(5), Catch::Contains("modes: is 5, want 1 to 4"));
}

TEST_CASE("a body model of parts that do not fit is refused by name") {
  const auto model = tubeModel(3, 10, 2);
  const auto refused = [&](const std::function<void(BodyParts&)>& spoil, const std::string& text) {
    BodyParts parts = model.parts();
    spoil(parts);
    CHECK_THROWS_WITH(BodyModel(parts), Catch::Contains(text));
  };
  refused([](BodyParts& parts) { parts.mean.conservativeResize(5, 3); }, "mean: is 5 x 3");
  refused([](BodyParts& parts) { parts.deviations[1] = 0; }, "deviations[1]: is 0.0");
  refused([](BodyParts& parts) { parts.modes.conservativeResize(Eigen::NoChange, 1); }, "modes: is ");
  refused([](BodyParts& parts) { parts.modes(3, 0) = NAN; }, "modes: is not finite");
  refused([](BodyParts& parts) { parts.regressor *= 2; }, "regressor[0]: sums to 2.0");
  refused([](BodyParts& parts) { parts.weights *= 0.5; }, "weights[0]: sums to 0.5");
  CHECK_THROWS_WITH(model.rest(Eigen::VectorXd::Zero(3)), Catch::Contains("identity: has 3 coefficients, want 2"));
}

TEST_CASE("without a rig a body model is a shape space that moves rigidly") {
  const auto mesh = icosphere(2);
  const auto reference = makePostureTemplate(mesh.topology, mesh.vertices, rigidRig(mesh.vertices));
  std::vector<Vertices> shapes;
  for (int i = 0; i < 6; ++i) {
    Vertices shape = mesh.vertices;
    shape.col(0) *= 1 + 0.1 * i;
    shape.col(1) *= 1 - 0.03 * i * i / 5;
    shapes.push_back(shape);
  }
  for (const auto how : {PostureNormalisation::kNone, PostureNormalisation::kSkeleton}) {
    BodyTrainingOptions options;
    options.posture = how;
    options.modes = 2;
    const auto model = trainBody(reference, shapes, options)->model;
    BodyState state{Eigen::Vector2d(1, -0.5), restPose(model.skeleton())};
    const Vertices still = model.posed(state).vertices();
    state.pose.rotations.row(0) << 0.3, 0.2, -1;
    state.pose.translation << 0, 1, 2;
    const Vertices moved = model.posed(state).vertices();
    CHECK(maxVertexDistance(apply(alignRigidly(still, moved), still), moved) < 1e-12);
    CHECK(maxVertexDistance(still, moved) > 1);
  }
}

TEST_CASE("training refuses what it cannot learn from") {
  const auto reference = tubeTemplate(3);
  auto shapes = tubeIdentities(reference, 3, 1);
  CHECK_THROWS_WITH(trainBody(reference, {shapes[0]}), Catch::Contains("registrations: has 1, want at least two"));
  CHECK_THROWS_WITH(trainBody(reference, {shapes[0], shapes[0]}), Catch::Contains("all the same shape"));
  shapes[1].conservativeResize(4, 3);
  CHECK_THROWS_WITH(trainBody(reference, shapes), Catch::Contains("registrations[1]"));
  BodyTrainingOptions options;
  options.explained = 1.5;
  CHECK_THROWS_WITH(trainBody(reference, shapes, options), Catch::Contains("explained = 1.5"));
}
