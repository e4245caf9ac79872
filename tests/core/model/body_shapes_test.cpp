#include "core/model/body_shapes.h"

#include <catch2/catch.hpp>

#include "core/mesh/quality.h"
#include "core/model/model_kinds.h"
#include "core/model/shell_pga_shapes.h"
#include "core/numerics/error.h"
#include "tests/support/bodies.h"
#include "tests/support/fields.h"
#include "tests/support/models.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::test;

namespace {

const BodyShapes& body() {
  static const BodyShapes model(test::tubeModel(3, 10, 4), {10, PostureNormalisation::kNone, 0.1, {}, 0});
  return model;
}

BodyState somebody(unsigned seed) {
  return {0.7 * randomIdentity(*body().model(), seed), randomPose(body().model()->skeleton(), 0.3, seed + 100)};
}

}  // namespace

TEST_CASE("a body is projected onto its own coefficients, and synthesized from them") {
  for (const unsigned seed : {1U, 2U, 3U}) {
    const auto state = somebody(seed);
    const Vertices shape = body().model()->posed(state).vertices();
    const auto projected = body().project(shape, {});
    CHECK(projected.converged());
    const auto& found = projected.solution;
    CHECK(rmsVertexDistance(found.shape, shape) < 1e-4);
    CHECK(found.score.residual_distance == Approx(rmsVertexDistance(found.shape, shape)));
    const auto& numbers = std::get<BodyCoefficients>(found.point).numbers;
    CHECK((numbers.head(4) - state.identity).norm() < 0.02);
    CHECK(found.score.mahalanobis == Approx(numbers.head(4).norm()));
    const auto again = body().synthesize(found.point, {});
    CHECK(again.solution.shape == found.shape);
    CHECK(again.solution.smallest_area_ratio == found.smallest_area_ratio);
  }
}

TEST_CASE("the log-likelihood of a body is that of a Gaussian in its tangent coordinates") {
  const auto state = somebody(4);
  const auto found = body().project(body().model()->posed(state).vertices(), {}).solution;
  double expected = 0;
  const auto& deviations = body().model()->parts().deviations;
  for (Eigen::Index m = 0; m < 4; ++m) {
    const double density = std::exp(-0.5 * std::pow(found.tangent_coordinates[m] / deviations[m], 2)) /
                           (deviations[m] * std::sqrt(2 * 3.14159265358979323846));
    expected += std::log(density);
  }
  CHECK(found.score.log_likelihood == Approx(expected).epsilon(1e-9));
}

TEST_CASE("fewer modes explain less of a body") {
  const Vertices shape = body().model()->posed(somebody(5)).vertices();
  const auto two = body().project(shape, {.modes = 2, .fine = false, .stop = {}}).solution;
  const auto all = body().project(shape, {}).solution;
  const auto& numbers = std::get<BodyCoefficients>(two.point).numbers;
  CHECK(numbers.size() == std::get<BodyCoefficients>(all.point).numbers.size());
  CHECK(numbers.segment(2, 2).isZero(0));
  CHECK(two.tangent_coordinates.size() == 2);
  CHECK(two.score.residual_distance > 2 * all.score.residual_distance);
  CHECK_THROWS_WITH(body().project(shape, {.modes = 5, .fine = false, .stop = {}}),
                    "modes: 5, want at most the model's 4");
}

TEST_CASE("coefficients that are none of a body are refused by what they lack") {
  CHECK_THROWS_WITH(body().synthesize(BodyCoefficients{Eigen::VectorXd::Zero(5)}, {}),
                    Catch::Contains("coefficients.body: has 5 numbers, want ") &&
                        Catch::Contains("identity (4), translation (3), rotations (3 for each of"));
  auto numbers = coefficientsOf(body().model()->meanState(), 4).numbers;
  numbers[2] = std::numeric_limits<double>::infinity();
  CHECK_THROWS_WITH(body().synthesize(BodyCoefficients{numbers}, {}), "coefficients.body[2]: is not a finite number");
  CHECK_THROWS_WITH(body().synthesize(SubmanifoldPoint{}, {}),
                    "coefficients: are those of a Shell PGA model, and the model is of kind body: want body");
  CHECK_THROWS_WITH(ShellPgaShapes(test::tubeModel()).synthesize(BodyCoefficients{numbers}, {}),
                    "coefficients: are those of a body, and the model is of kind shell_pga: want alpha and scale");
  CHECK_THROWS_WITH(body().project(Vertices::Zero(3, 3), {}), Catch::Contains("shape"));
}

TEST_CASE("models of every kind go through their files by the same door") {
  const TemporaryFolder folder;
  const ModelDirectory directory(folder.path());
  const auto provenance = nlohmann::json::object();
  const ShapeModelPtr shell = std::make_shared<ShellPgaShapes>(test::tubeModel());
  body().publish(directory, "b", provenance);
  shell->publish(directory, "s", provenance);
  for (const auto* name : {"b", "s"}) {
    const auto& before = *name == 'b' ? static_cast<const ShapeModel&>(body()) : *shell;
    const auto after = loadShapeModel(directory.load(name));
    CHECK(after->kind() == before.kind());
    CHECK(after->topology().id() == before.topology().id());
    CHECK(after->modes() == before.modes());
    CHECK(after->mean() == before.mean());
    CHECK(after->bytes() > after->topology().faces().size() * sizeof(int));
    CHECK(directory.load(name).manifest.kind == before.kind());
  }
  auto other = directory.load("b");
  other.manifest.kind = "blimp";
  CHECK_THROWS_WITH(loadShapeModel(other), Catch::Contains("model b version 1") &&
                                               Catch::Contains("is of kind \"blimp\", want \"shell_pga\" or \"body\""));
}

TEST_CASE("a body's field is made once, published along, and counted") {
  const auto& parts = body().model()->parts();
  const auto weights = constantField(scalingOf(*makeFieldReference(parts.topology, parts.mean)));
  const BodyShapes with_field(BodyModel(parts), body().training(), weights);
  CHECK(with_field.hasField());
  CHECK_FALSE(body().hasField());
  CHECK_FALSE(body().field());
  std::stop_source stop;
  stop.request_stop();
  CHECK_FALSE(with_field.field(stop.get_token()));
  with_field.warm();
  const auto field = with_field.field();
  REQUIRE(field);
  CHECK(field == with_field.field());
  CHECK(with_field.bytes() == body().bytes() + field->bytes());
  CHECK(field->bytes() > 1000);

  const TemporaryFolder folder;
  const ModelDirectory directory(folder.path());
  with_field.publish(directory, "m", nlohmann::json::object());
  const auto loaded = loadShapeModel(directory.load("m"));
  const auto& again = dynamic_cast<const BodyShapes&>(*loaded);
  REQUIRE(again.hasField());
  CHECK(again.field()->weights().mlp[0].bias == weights.mlp[0].bias);

  auto wrong = weights;
  wrong.source_net[0].bias.resize(1);
  CHECK_THROWS_WITH(BodyShapes(BodyModel(parts), body().training(), wrong), Catch::Contains("source_net"));
}
