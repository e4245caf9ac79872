#include "core/body/body_fit.h"

#include <catch2/catch.hpp>

#include "core/body/body_residuals.h"
#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "tests/support/bodies.h"

using namespace shaped;
using namespace shaped::test;

namespace {

/// Targets of both kinds on a posed body: points on faces, with and without a normal, of unequal weight.
std::vector<SurfaceTarget> mixedTargets(const BodyModel& model, const Vertices& shape) {
  std::vector<SurfaceTarget> targets;
  const auto& faces = model.topology()->faces();
  for (Eigen::Index f = 0; f < faces.rows(); f += 3) {
    SurfaceTarget target{{faces(f, 0), faces(f, 1), faces(f, 2)}, {0.2, 0.3, 0.5}, Eigen::Vector3d::Zero()};
    for (int c = 0; c < 3; ++c) target.position += target.barycentric[c] * shape.row(faces(f, c)).transpose();
    if (f % 2) target.normal = Eigen::Vector3d(1, double(f % 5), -1).normalized();
    target.weight = 0.5 + double(f % 4);
    targets.push_back(target);
  }
  return targets;
}

}  // namespace

TEST_CASE("derivatives of the body residuals meet central differences") {
  const auto model = tubeModel(4, 10, 3);
  const BodyState state{randomIdentity(model, 2), randomPose(model.skeleton(), 0.9, 3)};
  const auto targets = mixedTargets(model, jitter(model.parts().mean, 0.1, 3));
  const BodyResiduals residuals(model, targets, {});
  const auto rows = residuals.rows(state, model.posed(state));
  const Eigen::Index n = residuals.parameterCount();
  Eigen::VectorXd at(n);
  at << state.identity, toVector(state.pose);
  const auto values = [&](Eigen::Index parameter, double step) -> Eigen::VectorXd {
    const Eigen::VectorXd moved = at + step * Eigen::VectorXd::Unit(n, parameter);
    const BodyState there{moved.head(3), poseFrom(moved.tail(n - 3))};
    return residuals.rows(there, model.posed(there)).col(n);
  };
  const double step = 1e-4, scale = rows.leftCols(n).cwiseAbs().maxCoeff();
  for (Eigen::Index p = 0; p < n; ++p) {
    const Eigen::VectorXd expected =
        (8 * (values(p, step) - values(p, -step)) - (values(p, 2 * step) - values(p, -2 * step))) / (12 * step);
    CHECK((rows.col(p) - expected).cwiseAbs().maxCoeff() < 1e-8 * scale);
    CHECK(rows.col(p).norm() > 1e-3 * scale);
  }
}

TEST_CASE("the squares of the body residuals are those of their rows") {
  const auto model = tubeModel(4, 10, 3);
  const BodyState state{randomIdentity(model, 2), randomPose(model.skeleton(), 0.9, 3)};
  const auto targets = mixedTargets(model, jitter(model.parts().mean, 0.1, 3));
  const BodyResiduals residuals(model, targets, {});
  const Eigen::MatrixXd rows = residuals.rows(state, model.posed(state)), expected = rows.transpose() * rows;
  CHECK((residuals.squares(state, model.posed(state)) - expected).cwiseAbs().maxCoeff() <
        1e-12 * expected.cwiseAbs().maxCoeff());
  CHECK(residuals.energy(state, model.posed(state)) == Approx(rows.col(rows.cols() - 1).squaredNorm()).epsilon(1e-13));
}

TEST_CASE("fitting a body recovers identity and pose from its own vertices") {
  const auto model = tubeModel(4, 10, 3);
  const BodyState truth{randomIdentity(model, 4), randomPose(model.skeleton(), 0.5, 6)};
  BodyFitOptions options;
  options.prior = 1e-6;
  options.tolerance = 1e-12;
  const auto fit = fitBody(model, model.meanState(), vertexTargets(model.posed(truth).vertices()), options);
  CHECK(fit.converged());
  CHECK(maxVertexDistance(model.posed(fit.solution).vertices(), model.posed(truth).vertices()) < 1e-5);
  CHECK((fit.solution.identity - truth.identity).cwiseAbs().maxCoeff() < 1e-3);
}

TEST_CASE("the identity's prior pulls to the mean, the more the fewer observations count") {
  const auto model = tubeModel(4, 10, 3);
  const BodyState truth{Eigen::Vector3d(2, -1.5, 1), restPose(model.skeleton())};
  const auto targets = vertexTargets(model.posed(truth).vertices());
  BodyFitOptions options;
  double last = 1e9;
  for (const double observations : {1000.0, 1.0, 1e-3, 1e-6}) {
    options.observations = observations;
    const double length = fitBody(model, model.meanState(), targets, options).solution.identity.norm();
    CHECK(length < last);
    last = length;
  }
  CHECK(last < 0.1);
  CHECK(fitBody(model, truth, {}).solution.identity.norm() < 1e-6);
}

TEST_CASE("parts of a state that are held do not move, and joints stay within their limits") {
  auto parts = tubeModel(4, 10, 3).parts();
  parts.limits = JointLimits{Vertices::Constant(6, 3, -0.1), Vertices::Constant(6, 3, 0.2)};
  const BodyModel model(parts);
  const BodyState truth{randomIdentity(model, 4), randomPose(model.skeleton(), 0.8, 6)};
  const auto targets = vertexTargets(model.posed(truth).vertices());
  BodyFitOptions options;
  const auto limited = fitBody(model, model.meanState(), targets, options).solution.pose.rotations;
  CHECK(limited.bottomRows(5).maxCoeff() <= 0.2);
  CHECK(limited.bottomRows(5).minCoeff() >= -0.1);
  CHECK(limited.bottomRows(5).maxCoeff() > 0.19);  // they would like to go further
  options.limits = false;
  CHECK(fitBody(model, model.meanState(), targets, options).solution.pose.rotations.cwiseAbs().maxCoeff() > 0.25);
  options.pose = false;
  CHECK(fitBody(model, model.meanState(), targets, options).solution.pose.rotations.bottomRows(5).norm() == 0);
  options.identity = false;
  options.placement = false;
  const auto held = fitBody(model, model.meanState(), targets, options).solution;
  CHECK(held.identity.norm() == 0);
  CHECK(held.pose.rotations.norm() == 0);
}

TEST_CASE("several frames of one person agree on an identity that a single frame leaves open") {
  const auto model = tubeModel(4, 10, 3);
  const Eigen::VectorXd truth = randomIdentity(model, 4);
  // Each frame shows another half of the body.
  std::vector<std::vector<SurfaceTarget>> targets;
  BodySequence start{Eigen::VectorXd::Zero(3), {}};
  for (unsigned f = 0; f < 2; ++f) {
    const Pose pose = randomPose(model.skeleton(), 0.3, f);
    auto all = vertexTargets(model.posed({truth, pose}).vertices());
    std::erase_if(all, [&](const SurfaceTarget& t) { return (model.parts().mean(t.corners[0], 0) > 0) == (f == 0); });
    targets.push_back(all);
    start.poses.push_back(restPose(model.skeleton()));
  }
  BodyFitOptions options;
  options.prior = 1e-4;
  options.max_iterations = 500;
  const auto both = fitBodies(model, start, targets, options);
  CHECK((both.solution.identity - truth).cwiseAbs().maxCoeff() < 0.02);
  const auto first = fitBody(model, {start.identity, start.poses[0]}, targets[0], options);
  CHECK((first.solution.identity - truth).norm() > 2 * (both.solution.identity - truth).norm());
  options.pose = options.placement = false;
  const auto held = fitBodies(model, start, targets, options);
  CHECK(held.solution.poses[1].rotations.norm() == 0);
  CHECK(held.solution.identity.norm() > 0);
  CHECK_THROWS_WITH(fitBodies(model, {start.identity, {}}, targets), Catch::Contains("start.poses: has 0 entries"));
}

TEST_CASE("a body fit says how it ended") {
  const auto model = tubeModel(4, 10, 3);
  const BodyState truth{randomIdentity(model, 4), randomPose(model.skeleton(), 0.5, 6)};
  const auto targets = vertexTargets(model.posed(truth).vertices());
  BodyFitOptions options;
  options.max_iterations = 1;
  const auto short_fit = fitBody(model, model.meanState(), targets, options);
  CHECK(short_fit.termination == Termination::kIterationLimit);
  CHECK(short_fit.residual > options.tolerance);
  std::stop_source source;
  source.request_stop();
  options.stop = source.get_token();
  const auto stopped = fitBody(model, model.meanState(), targets, options);
  CHECK(stopped.termination == Termination::kCancelled);
  CHECK(stopped.solution.identity == model.meanState().identity);  // no step was taken on a cost that tells nothing
  CHECK(stopped.solution.pose.rotations == model.meanState().pose.rotations);
}

TEST_CASE("a body fit refuses targets that the model does not have") {
  const auto model = tubeModel(3, 10, 2);
  std::vector<SurfaceTarget> targets{{{0, 0, 0}, {1, 0, 0}, {0, 0, 0}}};
  targets[0].corners[1] = 100000;
  CHECK_THROWS_WITH(fitBody(model, model.meanState(), targets), Catch::Contains("targets[0]: names vertex 100000"));
  targets[0] = {{0, 0, 0}, {0.5, 0, 0}, {0, 0, 0}};
  CHECK_THROWS_WITH(fitBody(model, model.meanState(), targets),
                    Catch::Contains("targets[0]: has shares that do not sum"));
  targets[0] = {{0, 0, 0}, {1, 0, 0}, {NAN, 0, 0}};
  CHECK_THROWS_WITH(fitBody(model, model.meanState(), targets), Catch::Contains("targets[0]: is not finite"));
  BodyFitOptions options;
  options.sigma = 0;
  CHECK_THROWS_WITH(fitBody(model, model.meanState(), {}, options), Catch::Contains("sigma = 0"));
}
