// Motions and Bezier curves: rows 7, 10 and 11 of the table on [BvTH16].

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/curve/bezier.h"
#include "core/curve/joining.h"
#include "core/io/frames.h"
#include "core/mesh/quality.h"
#include "core/shell/energy.h"
#include "tests/benchmark/experiments/data.h"
#include "tests/benchmark/experiments/experiment.h"
#include "tests/benchmark/experiments/timing.h"

namespace shaped::experiments {
namespace {

std::vector<Vertices> sequence(const std::string& name) {
  return readFrames(dataPath("body_sequences/seq_" + name + "_f32.npy"));
}

void bezierOf(Report& report, const DataSet& set, const std::vector<std::size_t>& controls, int auxiliary) {
  std::vector<Vertices> shapes;
  for (const auto i : controls) shapes.push_back(set.shapes[i]);
  BezierOptions options;
  options.auxiliary = auxiliary;
  const Stopwatch watch;
  const auto structure = std::make_shared<const ShellStructure>(set.topology);
  const auto curve = bezierCurve(structure, defaultBending(shapes.front()), shapes, options);
  const double wall = watch.wall();
  double ratio = 1;
  const ReferenceAreas areas(set.topology->faces(), shapes.front());
  for (const auto& frame : curve.solution.curve.frames) ratio = std::min(ratio, areas.smallestRatio(frame));
  report.entry(text("%s, 4 control shapes of %d vertices, 32 frames, geodesics of %d: everything; geodesics; subspace; "
                    "missing; smallest area ratio; %s",
                    set.name.c_str(), set.topology->vertexCount(), auxiliary, name(curve.termination).data()),
               text("%.1f s, %.1f CPU s; %d; %ld; %.0e; %.2f", wall, watch.cpu(), curve.solution.geodesics,
                    static_cast<long>(curve.solution.dimension), curve.solution.missing, ratio),
               "<= 15 s", wall <= 15 && curve.converged());
}

/// Walks there and back, and again.
void closedClip(Report& report) {
  const auto topology = bodies1k().topology;
  auto frames = sequence("walk_muscular_1k");
  frames.resize(40);
  Curve curve{frames, true};
  curve.frames.insert(curve.frames.end(), frames.rbegin() + 1, frames.rend() - 1);
  SmoothingOptions options;
  options.steps = 3000;
  options.flow.tau = 0.9;
  const auto structure = std::make_shared<const ShellStructure>(topology);
  const auto result = smoothed(structure, defaultBending(frames.front()), curve, options);
  const auto& steps = result.solution.steps;
  std::string energies = text("%.4f", result.solution.path_energy_before);
  int falls = 0;
  double last = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < steps.size(); ++k) {
    falls += steps[k].path_energy < last ? 1 : 0;
    last = steps[k].path_energy;
    if (k == 0 || k == 9 || k == 99 || k == 999) energies += text(", %.2e after %zu", last, k + 1);
  }
  energies += text(", %.2e after %zu", last, steps.size());
  report.entry(text("a closed clip of %zu frames: path energy [m^2]; falling steps; %s", curve.size(),
                    name(result.termination).data()),
               text("%s; %d of %zu", energies.c_str(), falls, steps.size()), "to nothing",
               result.solution.path_energy_after < 1e-6 * result.solution.path_energy_before);
}

void joinedClips(Report& report, const std::string& what, const std::vector<std::vector<Vertices>>& clips, int steps) {
  const auto topology = bodies1k().topology;
  JoinOptions options;
  options.smoothing.steps = steps;
  options.up = Eigen::Vector3d::UnitY();
  const Stopwatch watch;
  const auto structure = std::make_shared<const ShellStructure>(topology);
  const auto result = joined(structure, defaultBending(clips[0][0]), clips, options);
  const auto& joint = result.solution;
  for (const auto& [before, after] : joint.seams) {
    double sharp = 0, smooth = 0;
    for (auto i = before; i <= after; ++i) {
      sharp = std::max(sharp, joint.gradient_before[i]);
      smooth = std::max(smooth, joint.gradient_after[i]);
    }
    report.entry(text("%s, seam at frames %zu to %zu of %zu: gradient before, after %d steps; wall s; %s", what.c_str(),
                      before, after, joint.curve.size(), joint.steps, name(result.termination).data()),
                 text("%.4f, %.4f m: 1/%.1f; %.1f", sharp, smooth, sharp / smooth, watch.wall()), "1/10",
                 sharp >= 10 * smooth);
  }
}

}  // namespace

void motions() {
  Report report("Motions and Bezier curves");
  for (const int auxiliary : {32, 9}) {
    bezierOf(report, coarsened(bodies(), 2000), {3, 20, 40, 60}, auxiliary);
    bezierOf(report, bodies(), {3, 20, 40, 60}, auxiliary);
  }
  closedClip(report);
  const auto walk = sequence("walk_muscular_1k"), run = sequence("run_muscular_1k"),
             jump = sequence("jump_muscular_1k");
  joinedClips(report, "walk, run, jump", {walk, run, jump}, 50);
  // As in the paper: geodesics between poses, which meet.
  std::vector<std::vector<Vertices>> legs;
  const auto set = bodies1k();
  const auto calculus = calculusOf(set, {defaultBending(set.shapes[0]), EnergySymmetry::kSymmetric});
  for (const auto& [from, to] : {std::pair{3, 20}, std::pair{20, 40}, std::pair{40, 60}})
    legs.push_back(calculus.interpolate(set.shapes[std::size_t(from)], set.shapes[std::size_t(to)], 24, {}).solution);
  joinedClips(report, "three geodesics", legs, 50);
}

}  // namespace shaped::experiments
