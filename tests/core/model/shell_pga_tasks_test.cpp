#include "core/model/shell_pga_tasks.h"

#include <catch2/catch.hpp>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "tests/support/calculus.h"
#include "tests/support/models.h"

using namespace shaped;
using namespace shaped::test;

TEST_CASE("a projection turns with its shape and does not depend on where it stands") {
  const auto& model = *tubeModel();
  const Vertices shape = bentTube(0.5);
  const auto still = project(model, shape, {}), turned = project(model, moveRigidly(shape, 2), {});
  REQUIRE(still.converged());
  REQUIRE(turned.converged());
  CHECK(rmsVertexDistance(still.solution.shape, shape) < 0.05);  // of a tube 4 m long
  CHECK(rmsVertexDistance(turned.solution.shape, moveRigidly(shape, 2)) < 0.05);
  CHECK((turned.solution.tangent_coordinates - still.solution.tangent_coordinates).norm() < 1e-4);
  CHECK(turned.solution.residual_energy == Approx(still.solution.residual_energy).epsilon(1e-3).margin(1e-9));
  const auto other = project(model, bentTube(-0.5), {});  // the control
  CHECK((other.solution.tangent_coordinates - still.solution.tangent_coordinates).norm() > 0.1);
}

TEST_CASE("coefficients of a projection make its shape again, coarse and at full resolution") {
  const auto& model = *tubeModel();
  for (const bool fine : {false, true}) {
    const auto projected = project(model, bentTube(0.5), {.modes = 0, .fine = fine, .stop = {}});
    const auto again = synthesize(model, projected.solution.coefficients, {.fine = fine, .stop = {}});
    REQUIRE(projected.converged());
    REQUIRE(again.converged());
    CHECK(rigidGap(again.solution.shape, projected.solution.shape) < 1e-4);
    CHECK(again.solution.smallest_area_ratio == Approx(projected.solution.smallest_area_ratio).epsilon(1e-3));
    CHECK(projected.solution.smallest_area_ratio > 0.3);
  }
}

TEST_CASE("the fine level balances the average at full resolution, which prolongation only nears") {
  const auto& model = *tubeModel();
  const auto coefficients = project(model, bentTube(0.5), {}).solution.coefficients;
  const auto coarse = synthesize(model, {coefficients.alpha, 1}, {}).solution.shape;
  const auto fine = synthesize(model, {coefficients.alpha, 1}, {.fine = true, .stop = {}}).solution.shape;
  const auto energy = [&](const Vertices& q) {  // (26) on the prolongated variations
    const auto& fine_model = *model.fineSubmanifold();
    double sum = 0;
    for (Eigen::Index j = 0; j < coefficients.alpha.size(); ++j)
      sum += coefficients.alpha[j] *
             shellEnergy(model.topology(), fine_model.variation(static_cast<std::size_t>(j)), q, model.parts().bending);
    return sum;
  };
  CHECK(energy(fine) < energy(coarse));
  CHECK(rigidGap(fine, coarse) < 0.05);
}

TEST_CASE("a score is the Gaussian's in closed form, over the modes that have variance") {
  auto parts = tubeModel()->parts();
  parts.pga.eigenvalues[0] = 0.09;
  parts.pga.eigenvalues[1] = 0.04;
  const ShellPgaModel model(parts);
  const Eigen::Vector2d y(0.6, -0.2);
  const auto score = scoreOf(model, y);
  CHECK(score.mahalanobis == Approx(std::sqrt(0.36 / 0.09 + 0.04 / 0.04)));
  CHECK(score.log_likelihood == Approx(-0.5 * (5 + std::log(0.09 * 0.04) + 2 * std::log(2 * M_PI))));
  CHECK(scoreOf(model, Eigen::Vector2d::Zero()).mahalanobis == 0);

  parts.pga.eigenvalues[1] = -1e-9;  // noise of the Gram matrix
  const auto without = scoreOf(ShellPgaModel(parts), y);
  CHECK(without.mahalanobis == Approx(2));
  CHECK(without.log_likelihood == Approx(-0.5 * (4 + std::log(0.09) + std::log(2 * M_PI))));
}

TEST_CASE("handles are met exactly at full resolution") {
  const auto& model = *tubeModel();
  const Vertices wanted = moveRigidly(bentTube(0.6), 5);
  std::vector<Handle> handles;
  for (const std::int32_t vertex : {0, 5, 70, 90, 150, 157})
    handles.push_back({vertex, wanted.row(vertex).transpose()});
  const auto edited = edit(model, handles, {});
  REQUIRE(edited.converged());
  CHECK(edited.solution.largest_handle_distance < 1e-9);
  CHECK(rmsVertexDistance(edited.solution.shape, wanted) < 0.1);
  CHECK(edited.solution.smallest_area_ratio > 0.2);
  for (std::size_t i = 1; i < edited.solution.energies.size(); ++i)
    CHECK(edited.solution.energies[i] < edited.solution.energies[i - 1]);
  const auto projection = synthesize(model, edited.solution.coefficients, {});
  CHECK(rigidGap(projection.solution.shape, edited.solution.projection) < 1e-3);
}

TEST_CASE("tasks refuse what does not fit, by name") {
  const auto& model = *tubeModel();
  CHECK_THROWS_WITH(project(model, Vertices::Zero(3, 3), {}), Catch::Contains("shape"));
  CHECK_THROWS_WITH(project(model, bentTube(0), {.modes = 3, .fine = false, .stop = {}}), Catch::Contains("modes"));
  CHECK_THROWS_WITH(synthesize(model, {Eigen::VectorXd::Constant(4, 0.3), 1}, {}), Catch::Contains("alpha"));
  CHECK_THROWS_WITH(synthesize(model, {Eigen::VectorXd::Constant(4, 0.25), 0}, {}), Catch::Contains("scale"));
  const Eigen::Vector3d at(0, 0, 0);
  CHECK_THROWS_WITH(edit(model, {{0, at}, {900, at}, {2, at}}, {}), Catch::Contains("handles[1]"));
  CHECK_THROWS_WITH(edit(model, {{0, at}, {1, at}, {0, at}}, {}),
                    Catch::Contains("handles[2]") && Catch::Contains("second time"));
  CHECK_THROWS_WITH(edit(model, {{0, at}, {1, {1, 0, 0}}, {2, {2, 0, 0}}}, {}), Catch::Contains("handles"));
  CHECK_THROWS_WITH(edit(model, {{0, at}, {1, {0, std::nan(""), 0}}, {2, at}}, {}), Catch::Contains("handles[1]"));
}

TEST_CASE("tasks stop when told to") {
  std::stop_source stop;
  stop.request_stop();
  const auto& model = *tubeModel();
  const std::vector<Handle> handles{{0, {0, 0, 0}}, {80, {1, 0, 0}}, {157, {2, 1, 0}}};
  CHECK(project(model, bentTube(0.4), {.modes = 0, .fine = true, .stop = stop.get_token()}).termination ==
        Termination::kCancelled);
  CHECK(edit(model, handles, {.modes = 0, .outer_iterations = 5, .stop = stop.get_token()}).termination ==
        Termination::kCancelled);
}

TEST_CASE("a point absurdly far from the mean ends without a solution") {
  SubmanifoldPoint point;
  point.alpha = Eigen::Vector4d(0.25, 0.25, 0.5, 0);
  point.scale = 1e-30;
  CHECK_FALSE(synthesize(*tubeModel(), point, {}).converged());
}
