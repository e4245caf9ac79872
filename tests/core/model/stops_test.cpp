// After a stop no work begins that takes long on large meshes, wherever a request was.
#include <tbb/task_arena.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <functional>
#include <stop_token>
#include <string_view>

#include "core/model/marker_fitter.h"
#include "core/model/shell_pga_evaluation.h"
#include "core/model/shell_pga_tasks.h"
#include "core/numerics/long_piece.h"
#include "tests/support/calculus.h"
#include "tests/support/models.h"

using namespace shaped;
using namespace shaped::test;

namespace {

using Task = std::function<Termination(std::stop_token)>;

struct Stopped {
  Termination termination;
  bool fired;
  int begun_after;  ///< pieces, without the solves, of which one takes a tenth of a factorisation
};

int piecesOf(const Task& task) {
  std::atomic<int> count{0};
  const PieceListening listening([&](std::string_view, bool begins) { count += begins ? 1 : 0; });
  task({});
  return count;
}

/// Stops the task when its piece of that number begins.
Stopped stopAt(const Task& task, int piece) {
  std::stop_source stop;
  std::atomic<int> count{0}, after{0};
  const PieceListening listening([&](std::string_view name, bool begins) {
    if (!begins) return;
    if (stop.stop_requested() && name != "solve") ++after;
    if (count++ == piece) stop.request_stop();
  });
  const auto termination = task(stop.get_token());
  return {termination, stop.stop_requested(), after};
}

/// In one thread: in a second one a piece may begin just before it could know.
void requireNothingBegins(const Task& in_parallel) {
  tbb::task_arena alone(1);
  const Task task = [&](std::stop_token stop) { return alone.execute([&] { return in_parallel(stop); }); };
  task({});  // what is made once a model is there from now on
  const int pieces = piecesOf(task);
  REQUIRE(pieces > 10);
  for (int i = 0; i < 12; ++i) {
    const int piece = static_cast<int>((i + 0.5) / 12 * pieces);
    INFO("stopped at piece " << piece << " of " << pieces);
    const auto stopped = stopAt(task, piece);
    REQUIRE(stopped.fired);
    CHECK(stopped.begun_after == 0);
    CHECK(stopped.termination == Termination::kCancelled);
  }
}

}  // namespace

TEST_CASE("after a stop a projection begins nothing long") {
  const auto& model = *tubeModel();
  for (const bool fine : {false, true})
    requireNothingBegins([&](std::stop_token stop) {
      return project(model, bentTube(0.5), {.modes = 0, .fine = fine, .stop = std::move(stop)}).termination;
    });
}

TEST_CASE("after a stop a synthesis begins nothing long") {
  const auto& model = *tubeModel();
  const auto point = model.submanifold().pointOf(Eigen::VectorXd::Constant(model.modes(), 0.1));
  requireNothingBegins([&](std::stop_token stop) {
    return synthesize(model, point, {.fine = true, .stop = std::move(stop)}).termination;
  });
}

TEST_CASE("after a stop an edit begins nothing long") {
  const auto& model = *tubeModel();
  std::vector<Handle> handles;
  for (const std::int32_t vertex : {0, 40, model.topology().vertexCount() - 1})
    handles.push_back({vertex, model.mean().row(vertex).transpose() + Eigen::Vector3d(0, 0.1, 0.2)});
  requireNothingBegins(
      [&](std::stop_token stop) { return edit(model, handles, {.stop = std::move(stop)}).termination; });
}

TEST_CASE("after a stop a path between shapes begins nothing long") {
  const auto& model = *tubeModel();
  const auto& calculus = model.submanifold().calculus();
  const auto& variations = model.submanifold().pga().variations;
  const Vertices a = variations[0], b = variations[variations.size() - 1];
  requireNothingBegins([&](std::stop_token stop) {
    GeodesicOptions options;
    options.stop = std::move(stop);
    const auto path = calculus.interpolate(a, b, 4, options);
    return path.converged() ? calculus.at(path.solution, 1.4, options).termination : path.termination;
  });
}

TEST_CASE("after a stop a training begins nothing long") {
  const auto set = fourTubes();
  requireNothingBegins(
      [&](std::stop_token stop) { return trainShellPga(set, smallTraining(), {}, std::move(stop)).termination; });
}

TEST_CASE("after a stop an evaluation begins nothing long") {
  const auto& model = *tubeModel();
  const auto shapes = fourTubes().shapes;
  requireNothingBegins([&](std::stop_token stop) {
    EvaluationOptions options;
    options.folds = 2;
    options.specificity_samples = 3;
    options.stop = std::move(stop);
    return evaluate(model, shapes, options, {}).termination;
  });
}

TEST_CASE("after a stop a marker fit begins nothing long, in the first frame and in the next") {
  const auto model = tubeModel();
  MarkerSet markers;
  MarkerPositions positions(12, 3);
  for (Eigen::Index i = 0; i < positions.rows(); ++i) {
    const auto vertex = static_cast<std::int32_t>(i * (model->topology().vertexCount() - 1) / positions.rows());
    markers.markers.push_back({.label = std::to_string(i), .vertex = vertex});
    positions.row(i) = bentTube(0.6).row(vertex);
  }
  requireNothingBegins([&](std::stop_token stop) {
    MarkerTrackerOptions options;
    options.submanifold.stop = std::move(stop);
    MarkerFitter fitter(model, markers, options);
    const auto first = fitter.fit(positions);
    return first.converged() ? fitter.fit(1.02 * positions).termination : first.termination;
  });
}

TEST_CASE("after a stop nothing long begins of what a model makes at the first request at full resolution") {
  const Vertices shape = bentTube(0.5);
  requireNothingBegins([&](std::stop_token stop) {
    const ShellPgaModel fresh(tubeModel()->parts());
    return project(fresh, shape, {.modes = 0, .fine = true, .stop = std::move(stop)}).termination;
  });
}
