// How long a solver goes on after its stop token has fired, in processor time of its one thread, for stops spread
// evenly over its work. Made-up shapes, so that it needs no data: an irregular tube of 7,002 vertices in several bends,
// the size of the meshes that requests are made with.

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <functional>
#include <stop_token>
#include <thread>

#include "core/geodesic/geodesic.h"
#include "core/model/marker_fitter.h"
#include "core/model/shell_pga_evaluation.h"
#include "core/model/shell_pga_tasks.h"
#include "core/model/shell_pga_training.h"
#include "core/shell/energy.h"
#include "core/shell/shell_objective.h"
#include "tests/benchmark/experiments/experiment.h"
#include "tests/benchmark/experiments/timing.h"
#include "tests/support/shapes.h"

namespace shaped::experiments {
namespace {

using Task = std::function<void(std::stop_token)>;

constexpr double kLongest = 0.1;  // [s]

/// Processor time of a thread [s]: what other programs do meanwhile does not count.
class ThreadClock {
 public:
  ThreadClock() { pthread_getcpuclockid(pthread_self(), &clock_); }  // of the thread that makes it
  double seconds() const {
    timespec now{};
    clock_gettime(clock_, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  }

 private:
  clockid_t clock_{};
};

/// Fires once the thread that makes it has worked for so long, and remembers when that was.
class LateStop {
 public:
  explicit LateStop(double after)
      : begin_(clock_.seconds()), thread_([this, after](const std::stop_token& over) {
          while (clock_.seconds() - begin_ < after) {
            if (over.stop_requested()) return;
            std::this_thread::sleep_for(std::chrono::microseconds(300));
          }
          fired_ = clock_.seconds();
          source_.request_stop();
        }) {}
  std::stop_token token() const { return source_.get_token(); }
  /// What the thread has worked since the stop [s]; negative when it has not come.
  double worked() {
    const double now = clock_.seconds();
    thread_.request_stop();
    thread_.join();
    return source_.stop_requested() && fired_ <= now ? now - fired_ : -1;
  }

 private:
  const ThreadClock clock_;
  const double begin_;
  std::stop_source source_;
  double fired_ = 0;
  std::jthread thread_;
};

void measureStops(Report& report, const std::string& name, const Task& task) {
  const ThreadClock clock;
  const double begin = clock.seconds();
  task({});
  const double whole = clock.seconds() - begin;
  const int stops = std::clamp(static_cast<int>(30 / whole), 16, 100);
  std::vector<double> waits;
  for (int i = 0; i < stops; ++i) {
    LateStop stop((i + 0.5) / stops * whole);
    task(stop.token());
    if (const double wait = stop.worked(); wait >= 0) waits.push_back(wait);
  }
  const double longest = *std::max_element(waits.begin(), waits.end());
  report.entry(
      text("%s; %.3g s when not stopped", name.c_str(), whole),
      text("median %.1f ms, longest %.0f ms of %d", 1e3 * median(waits), 1e3 * longest, static_cast<int>(waits.size())),
      "<= 100 ms", longest <= kLongest);
}

/// What nothing interrupts.
void measureIndivisible(Report& report, const TopologyPtr& topology, const Vertices& shape) {
  const ThreadClock clock;
  double begin = clock.seconds();
  const auto structure = std::make_shared<const ShellStructure>(topology);
  const double ordering = clock.seconds() - begin;
  ShellObjective objective(structure, defaultBending(shape));
  objective.addDeformed(measure(*topology, shape), 1);
  SymmetricBlockMatrix hessian(structure->pattern());
  CholeskyFactor factor(structure->analysis());
  const Eigen::VectorXd x = flatten(shape);
  std::vector<double> assemblies, factorisations;
  for (int i = 0; i < 9; ++i) {
    begin = clock.seconds();
    hessian.setZero();
    objective.hessian(x, false, hessian);
    const double middle = clock.seconds();
    factor.factorise(hessian, objective.pins(x));
    assemblies.push_back(middle - begin);
    factorisations.push_back(clock.seconds() - middle);
  }
  report.entry(
      text("indivisible on %d vertices: ordering, once a mesh; a Hessian; its factorisation", topology->vertexCount()),
      text("%.0f, %.0f, %.0f ms", 1e3 * ordering, 1e3 * median(assemblies), 1e3 * median(factorisations)));
}

ShellPgaTrainingSet tubes(int rings, int sides) {
  const auto mesh = test::tube(rings, sides);
  ShellPgaTrainingSet set{mesh.topology, {}, {}};
  for (int i = 0; i < 12; ++i) {
    Vertices shape = test::jitter(mesh.vertices, 0.002, 5);
    shape.col(1) *= 1 + 0.03 * (i % 4);
    shape.col(2) *= 1 + 0.04 * (i % 3);
    set.shapes.push_back(test::bend(shape, -1.5 + 0.27 * i));
  }
  return set;
}

std::vector<Handle> handlesOn(const Vertices& shape) {
  std::vector<Handle> handles;
  for (const double share : {0.02, 0.2, 0.35, 0.5, 0.65, 0.8, 0.98}) {
    const auto vertex = static_cast<std::int32_t>(share * static_cast<double>(shape.rows()));
    handles.push_back({vertex, shape.row(vertex).transpose() + Eigen::Vector3d(0, 0.1 * share, 0.2)});
  }
  return handles;
}

void fitFrames(const ShellPgaModelPtr& model, const Vertices& shape, std::stop_token stop) {
  MarkerSet markers;
  MarkerPositions positions(40, 3);
  for (Eigen::Index i = 0; i < positions.rows(); ++i) {
    const auto vertex = i * (shape.rows() - 1) / positions.rows();
    markers.markers.push_back({.label = std::to_string(i), .vertex = static_cast<std::int32_t>(vertex)});
    positions.row(i) = 1.1 * shape.row(vertex);
  }
  MarkerTrackerOptions options;
  options.submanifold.stop = std::move(stop);
  MarkerFitter fitter(model, markers, options);
  fitter.fit(positions);
}

}  // namespace

void stopLatency() {
  const OneThread one;
  Report report("From a stop to the end of the work");
  const auto set = tubes(140, 50);
  measureIndivisible(report, set.topology, set.shapes.front());
  ShellPgaTrainingOptions training;
  training.modes = 8;
  ShellPgaModelPtr model;
  measureStops(report, "training, 12 shapes of 7,002 vertices", [&](std::stop_token stop) {
    if (auto trained = trainShellPga(set, training, {}, std::move(stop)).solution) model = std::move(trained);
  });
  const Vertices shape = test::bend(test::tube(140, 50).vertices, 1.1);
  SubmanifoldPoint point = model->submanifold().pointOf(Eigen::VectorXd::Constant(model->modes(), 0.1));
  const GeodesicCalculus calculus(std::make_shared<const ShellStructure>(set.topology), defaultBending(shape));
  measureStops(report, "project", [&](std::stop_token stop) { project(*model, shape, {.stop = std::move(stop)}); });
  measureStops(report, "project, fine",
               [&](std::stop_token stop) { project(*model, shape, {.fine = true, .stop = std::move(stop)}); });
  measureStops(report, "synthesize, fine",
               [&](std::stop_token stop) { synthesize(*model, point, {.fine = true, .stop = std::move(stop)}); });
  measureStops(report, "edit, 7 handles",
               [&](std::stop_token stop) { edit(*model, handlesOn(shape), {.stop = std::move(stop)}); });
  measureStops(report, "fit of a first frame, 40 markers",
               [&](std::stop_token stop) { fitFrames(model, shape, std::move(stop)); });
  measureStops(report, "path of 4 steps between meshes of 7,002 vertices, 3 times and one beyond",
               [&](std::stop_token stop) {
                 GeodesicOptions options;
                 options.stop = std::move(stop);
                 const auto path = calculus.interpolate(set.shapes[2], set.shapes[8], 4, options);
                 for (const double time : {0.3, 0.7, 1.4})
                   if (path.converged()) calculus.at(path.solution, time, options);
               });
  measureStops(report, "evaluate, 3 folds", [&](std::stop_token stop) {
    EvaluationOptions options;
    options.folds = 3;
    options.specificity_samples = 20;
    options.stop = std::move(stop);
    evaluate(*model, set.shapes, options, {});
  });
}

}  // namespace shaped::experiments
