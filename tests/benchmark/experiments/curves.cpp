// Curves in shape space: the rows of [BvTH16] that are built so far. Wall seconds with the machine's threads, CPU
// seconds of the process.

#include <cmath>
#include <numeric>

#include "core/curve/geodesic_flow.h"
#include "core/curve/reduced_curve.h"
#include "core/io/frames.h"
#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/shell/energy.h"
#include "tests/benchmark/experiments/data.h"
#include "tests/benchmark/experiments/experiment.h"
#include "tests/benchmark/experiments/timing.h"

namespace shaped::experiments {
namespace {

/// sum of sqrt(E) over the segments.
double lengthOf(const Topology& topology, double bending, const Curve& curve) {
  double length = 0;
  for (const double energy : segmentEnergies(topology, bending, curve, measuresOf(topology, curve)))
    length += std::sqrt(energy);
  return length;
}

/// Norm of the difference after the best rigid fit of each pair of shapes, over the summed norms of the second's.
double relativeDifference(const Curve& curve, const Path& reference) {
  double squares = 0, norms = 0;
  for (std::size_t i = 0; i < reference.size(); ++i) {
    const auto& shape = curve.frames[i];
    squares += (apply(alignRigidly(shape, reference[i]), shape) - reference[i]).squaredNorm();
    norms += (reference[i].rowwise() - reference[i].colwise().mean()).norm();
  }
  return std::sqrt(squares) / norms;
}

void compare(Report& report, const DataSet& set, std::size_t from, std::size_t to, int frames) {
  const double bending = defaultBending(set.shapes.front());
  const auto calculus = calculusOf(set, {bending, EnergySymmetry::kSymmetric});
  GeodesicFlowOptions options;
  options.frames = frames;
  options.ghost_vertices = set.topology->vertexCount();
  options.enrichments = 4;
  options.tolerance = 1e-6;
  const Stopwatch watch;
  const auto reduced =
      geodesicByFlow(calculus.structure(), bending, set.shapes[from], set.shapes[to], options).solution;
  const double seconds = watch.cpu();
  const Stopwatch full_watch;
  const auto full = calculus.interpolate(set.shapes[from], set.shapes[to], frames - 1, {});
  const double full_seconds = full_watch.cpu();
  const double longer =
      lengthOf(*set.topology, bending, reduced.curve) / lengthOf(*set.topology, bending, {full.solution, false}) - 1;
  const double difference = relativeDifference(reduced.curve, full.solution);
  report.entry(text("%s %zu -> %zu, %d shapes of %d vertices: length, reduced over full; difference; subspace; CPU s "
                    "reduced, full",
                    set.name.c_str(), from, to, frames, set.topology->vertexCount()),
               text("%+.4f %%; %.1e; %ld; %.1f, %.1f", 100 * longer, difference, static_cast<long>(reduced.dimension),
                    seconds, full_seconds),
               "0.1 %; 1e-5", std::abs(longer) <= 1e-3 && difference <= 1e-5);
}

/// There and back, walking and running: a clip of 138 frames at full resolution.
Curve longClip() {
  Curve curve{{}, false};
  for (const char* name : {"walk", "run"}) {
    const auto frames = readFrames(dataPath(std::string("body_sequences/seq_") + name + "_muscular_full_f32.npy"));
    curve.frames.insert(curve.frames.end(), frames.begin(), frames.end());
    curve.frames.insert(curve.frames.end(), frames.rbegin(), frames.rend());
  }
  curve.frames.resize(138);
  return curve;
}

void smoothing(Report& report) {
  const auto clip = longClip();
  const auto topology = bodies().topology;
  const Stopwatch preparing;
  const ReducedCurve reduced(topology, defaultBending(clip.frames.front()), clip, {});
  auto flow = reduced.flow({});
  const double prepared = preparing.wall(), prepared_cpu = preparing.cpu();
  std::vector<double> wall, cpu;
  bool falls = true;
  for (int k = 0; k < 30; ++k) {
    const double before = flow.pathEnergy();
    const Stopwatch watch;
    falls = flow.step().converged() && flow.pathEnergy() < before && falls;
    wall.push_back(watch.wall());
    cpu.push_back(watch.cpu());
  }
  report.entry(
      text("%zu frames of %d vertices, subspace %ld, ghost of %d: preparing", clip.size(), topology->vertexCount(),
           static_cast<long>(reduced.space().dimension()), reduced.space().topology()->vertexCount()),
      text("%.2f s; %.2f CPU s", prepared, prepared_cpu));
  report.entry("a step, median of 30", text("%.3f s; %.3f CPU s", median(wall), median(cpu)), "<= 0.10 s",
               median(wall) <= 0.1);
  report.entry("the path energy falls in every step", falls ? "30 of 30" : "not always", "all", falls);
}

void longGeodesic(Report& report, const DataSet& set, int frames, const char* target, double limit) {
  GeodesicFlowOptions options;
  options.frames = frames;
  const Stopwatch watch;
  const auto structure = std::make_shared<const ShellStructure>(set.topology);
  const auto flow =
      geodesicByFlow(structure, defaultBending(set.shapes.front()), set.shapes[3], set.shapes[20], options);
  const double wall = watch.wall();
  double ratio = 1;
  for (const auto& frame : flow.solution.curve.frames)
    ratio = std::min(ratio, smallestAreaRatio(set.topology->faces(), set.shapes[3], frame));
  report.entry(text("%s 3 -> 20, %d shapes of %d vertices, everything: %s; smallest area ratio", set.name.c_str(),
                    frames, set.topology->vertexCount(), name(flow.termination).data()),
               text("%.2f s; %.2f CPU s; %.2f", wall, watch.cpu(), ratio), target, wall <= limit && flow.converged());
}

}  // namespace

void curves() {
  Report report("Curves in shape space");
  const auto small = bodies1k(), horses = horse();
  for (const int frames : {8, 64}) {
    compare(report, small, 3, 20, frames);
    compare(report, horses, 10, 20, frames);
  }
  smoothing(report);
  longGeodesic(report, coarsened(bodies(), 2000), 64, "<= 1.5 s", 1.5);
  longGeodesic(report, bodies(), 256, "<= 15 s", 15);
}

}  // namespace shaped::experiments
