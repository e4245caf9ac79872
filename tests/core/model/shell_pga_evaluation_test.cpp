#include "core/model/shell_pga_evaluation.h"

#include <catch2/catch.hpp>

#include "core/numerics/error.h"
#include "tests/support/models.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::test;

namespace {

std::vector<Vertices> tubes() {
  std::vector<Vertices> shapes;
  for (const double angle : {-0.9, -0.4, 0.2, 0.8, 0.5}) shapes.push_back(bentTube(angle));
  shapes[1].col(2) *= 1.2;
  shapes[4].col(2) *= 0.9;
  return shapes;
}

EvaluationOptions brief() {
  EvaluationOptions options;
  options.specificity_samples = 3;
  return options;
}

}  // namespace

TEST_CASE("an evaluation measures compactness in closed form, and errors that fall with the modes") {
  const auto& model = *tubeModel();
  const auto solved = evaluate(model, tubes(), brief(), {});
  REQUIRE(solved.converged());
  const auto& evaluation = solved.solution;
  REQUIRE(evaluation.modes == std::vector<int>{1, 2});
  const Eigen::VectorXd variances = model.pga().eigenvalues.cwiseMax(0);
  CHECK(evaluation.compactness[0] == Approx(variances[0] / variances.sum()));
  CHECK(evaluation.compactness[1] == Approx(variances.head(2).sum() / variances.sum()));
  CHECK(evaluation.generalisation[1].elastic < evaluation.generalisation[0].elastic);
  CHECK(evaluation.linear[1].vertex < evaluation.linear[0].vertex);
  for (const double specificity : evaluation.specificity) CHECK(specificity > 0);
  CHECK(evaluate(model, tubes(), brief(), {}).solution.specificity ==
        evaluation.specificity);  // the same random shapes
}

TEST_CASE("fewer folds leave more shapes out of each training") {
  const auto& model = *tubeModel();
  auto options = brief();
  options.modes = {1};
  options.folds = 2;
  const auto halves = evaluate(model, tubes(), options, {});
  REQUIRE(halves.converged());
  options.folds = 0;
  const auto single = evaluate(model, tubes(), options, {});
  CHECK(halves.solution.generalisation[0].elastic != single.solution.generalisation[0].elastic);
}

TEST_CASE("an evaluation resumed from any of its states gives the same numbers, bit by bit") {
  const auto& model = *tubeModel();
  std::vector<ShellPgaEvaluationState> states;
  const auto whole = evaluate(model, tubes(), brief(), {}, {[&](const auto& state) { states.push_back(state); }, {}});
  REQUIRE(states.size() == 1 + 5 + 2);  // the mean, five folds, two dimensions
  const TemporaryFolder folder;
  for (const auto& state : states) {
    INFO(state.stage());
    writeEvaluationState(folder / "s", state);
    const auto read = readEvaluationState(folder / "s");
    int offered = 0;
    const auto resumed = evaluate(model, tubes(), brief(), {}, {[&](const auto&) { ++offered; }, &read});
    CHECK(resumed.iterations == whole.iterations);
    CHECK(resumed.residual == whole.residual);
    CHECK(resumed.solution.specificity == whole.solution.specificity);
    for (std::size_t m = 0; m < 2; ++m) {
      CHECK(resumed.solution.generalisation[m].elastic == whole.solution.generalisation[m].elastic);
      CHECK(resumed.solution.linear[m].vertex == whole.solution.linear[m].vertex);
    }
    CHECK(offered == std::ssize(states) - 1 - (&state - states.data()));  // what is left to do
  }
  auto bytes = bytesOf(folder / "s");
  bytes[bytes.size() - 3] ^= 1;
  CHECK_THROWS_WITH(readEvaluationState(folder.file("damaged", bytes)), Catch::Contains("damaged"));
}

TEST_CASE("an evaluation that is stopped has not done the fold it was at") {
  const auto& model = *tubeModel();
  std::stop_source stop;
  auto options = brief();
  options.stop = stop.get_token();
  ShellPgaEvaluationState last;
  const auto stopped = evaluate(model, tubes(), options,
                                [&](const Progress& progress) {
                                  if (progress.stage == "fold 3 of 5") stop.request_stop();
                                },
                                {[&](const auto& state) { last = state; }, nullptr});
  CHECK(stopped.termination == Termination::kCancelled);
  CHECK(last.folds == 2);
}

TEST_CASE("evaluations that cannot be made are refused by name") {
  const auto& model = *tubeModel();
  auto three = tubes();
  three.resize(3);
  auto options = brief();
  options.folds = 2;
  CHECK_THROWS_WITH(evaluate(model, three, options, {}), Catch::Contains("folds") && Catch::Contains("at least two"));
  options.folds = 1;
  CHECK_THROWS_WITH(evaluate(model, tubes(), options, {}), Catch::Contains("folds"));
  options.folds = 6;
  CHECK_THROWS_WITH(evaluate(model, tubes(), options, {}), Catch::Contains("folds"));
  options = brief();
  options.modes = {1, 3};
  CHECK_THROWS_WITH(evaluate(model, tubes(), options, {}), Catch::Contains("modes[1]"));
  auto two = tubes();
  two.resize(2);
  CHECK_THROWS_WITH(evaluate(model, two, brief(), {}), Catch::Contains("shapes"));
  auto broken = tubes();
  broken[2].conservativeResize(5, 3);
  CHECK_THROWS_WITH(evaluate(model, broken, brief(), {}), Catch::Contains("shapes[2]"));
  std::stop_source stop;
  stop.request_stop();
  options = brief();
  options.stop = stop.get_token();
  CHECK(evaluate(model, tubes(), options, {}).termination == Termination::kCancelled);
}
