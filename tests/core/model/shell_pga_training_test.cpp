#include "core/model/shell_pga_training.h"

#include <tbb/global_control.h>

#include <catch2/catch.hpp>

#include "core/numerics/error.h"
#include "tests/support/models.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;

namespace {

void checkRefused(const ShellPgaTrainingSet& set, const ShellPgaTrainingOptions& options, const std::string& reason) {
  CHECK_THROWS_AS(trainShellPga(set, options, {}, {}), InvalidInput);
  CHECK_THROWS_WITH(trainShellPga(set, options, {}, {}), Catch::Contains(reason));
}

}  // namespace

TEST_CASE("training says how it ended, and moves on without going back") {
  double last = 0;
  std::vector<std::string> stages;
  const auto trained = trainShellPga(fourTubes(), smallTraining(),
                                     [&](const Progress& progress) {
                                       CHECK(progress.fraction >= last);
                                       last = progress.fraction;
                                       if (stages.empty() || stages.back() != progress.stage)
                                         stages.push_back(progress.stage);
                                     },
                                     {});
  REQUIRE(trained.converged());
  CHECK(last == 1);
  CHECK(stages.size() > 3);
  const auto& model = *trained.solution;
  CHECK(model.modes() == 2);
  CHECK(model.parts().training.shapes == 4);
  CHECK(model.parts().training.mean.residual <= 1e-8);
  CHECK(model.parts().coarsening.coarse->vertexCount() <= 60);
  CHECK(model.mean().rows() == fourTubes().shapes[0].rows());
  CHECK(model.pga().eigenvalues[0] > model.pga().eigenvalues[1]);
}

TEST_CASE("training gives the same model whatever the number of threads") {
  const auto with = [](std::size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return trainShellPga(fourTubes(), smallTraining(), {}, {}).solution;
  };
  const auto one = with(1), two = with(2);
  CHECK(one->pga().eigenvalues == two->pga().eigenvalues);
  CHECK(one->mean() == two->mean());
}

TEST_CASE("rigid motions of the training shapes change no eigenvalue, another size does") {
  auto moved = fourTubes();
  for (std::size_t i = 0; i < moved.shapes.size(); ++i)
    moved.shapes[i] = moveRigidly(moved.shapes[i], static_cast<unsigned>(i) + 3);
  const auto before = trainShellPga(fourTubes(), smallTraining(), {}, {}).solution,
             after = trainShellPga(moved, smallTraining(), {}, {}).solution;
  const Eigen::ArrayXd still = before->pga().eigenvalues.head(3), turned = after->pga().eigenvalues.head(3);
  CHECK(((turned - still) / still).abs().maxCoeff() < 1e-6);
  moved.shapes[0] *= 1.1;  // the control
  const Eigen::ArrayXd scaled = trainShellPga(moved, smallTraining(), {}, {}).solution->pga().eigenvalues.head(3);
  CHECK(((scaled - still) / still).abs().maxCoeff() > 1e-2);
}

TEST_CASE("a cancelled training has no model") {
  std::stop_source stop;
  stop.request_stop();
  const auto cancelled = trainShellPga(fourTubes(), smallTraining(), {}, stop.get_token());
  CHECK(cancelled.termination == Termination::kCancelled);
  CHECK(!cancelled.solution);
}

TEST_CASE("training sets and options that make no model are refused by name") {
  auto one = fourTubes();
  one.shapes.resize(1);
  checkRefused(one, smallTraining(), "at least two training shapes");
  auto alike = fourTubes();
  alike.shapes[2] = moveRigidly(alike.shapes[1], 8);
  checkRefused(alike, smallTraining(), "shapes[2]");
  auto shorter = fourTubes();
  shorter.shapes[3].conservativeResize(10, 3);
  checkRefused(shorter, smallTraining(), "shapes[3]");
  auto broken = fourTubes();
  broken.shapes[1](4, 2) = std::nan("");
  checkRefused(broken, smallTraining(), "shapes[1]");
  auto other_template = fourTubes();
  other_template.template_shape = Vertices::Zero(3, 3);
  checkRefused(other_template, smallTraining(), "template");

  const auto with = [](auto change) {
    auto options = smallTraining();
    change(options);
    return options;
  };
  checkRefused(fourTubes(), with([](auto& o) { o.modes = 4; }), "modes = 4, want 1 to 3");
  checkRefused(fourTubes(), with([](auto& o) { o.modes = 0; }), "modes = 0");
  checkRefused(fourTubes(), with([](auto& o) { o.path_steps = 0; }), "path_steps = 0");
  checkRefused(fourTubes(), with([](auto& o) { o.bending = -1.0; }), "bending");
  checkRefused(fourTubes(), with([](auto& o) { o.coarse_vertices = 20; }), "coarse_vertices = 20");
  checkRefused(fourTubes(), with([](auto& o) { o.tolerance = 0; }), "tolerance");
  checkRefused(fourTubes(), with([](auto& o) { o.iterations = 0; }), "iterations");
}
