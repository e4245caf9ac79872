// Curves in shape space: geodesics and the cost of the flow, rows 1 to 6 and 9 of the table on [BvTH16]. Wall seconds
// with the machine's threads, CPU seconds of the process.

#include <algorithm>
#include <cmath>
#include <numbers>
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

/// What the full problem makes of a reduced geodesic: of it as it is, and with every inner vertex moved a little,
/// evenly over the frames or anew in each. Where the last alone leaves, the reduced one is a minimum of the full
/// problem that has another one near.
void stability(Report& report, const GeodesicCalculus& calculus, const std::string& what, const Curve& reduced) {
  constexpr double shake = 1e-4;  // m
  const auto& frames = reduced.frames;
  const int steps = static_cast<int>(frames.size()) - 1;
  const auto length = [&](const Path& path) {
    return lengthOf(calculus.topology(), calculus.bending(), {path, false});
  };
  const Path still = frames;
  Path evenly = frames, anew = frames;
  std::srand(3);
  const Vertices pattern = shake * Vertices::Random(frames.front().rows(), 3);
  for (std::size_t i = 1; i + 1 < frames.size(); ++i) {
    evenly[i] += std::sin(std::numbers::pi * static_cast<double>(i) / steps) * pattern;
    anew[i] += shake * Vertices::Random(anew[i].rows(), 3);
  }
  for (const auto& [start, how] :
       {std::pair<const Path*, const char*>{&still, "as it is"},
        std::pair<const Path*, const char*>{&evenly, "moved by up to 0.1 mm evenly"},
        std::pair<const Path*, const char*>{&anew, "moved by up to 0.1 mm in each frame anew"}}) {
    const auto solved = calculus.interpolate(frames.front(), frames.back(), steps, {}, *start);
    report.entry(
        what + ", the full problem started from the reduced path " + how,
        text("%s, difference %.1e, length %+.4f %%", name(solved.termination).data(),
             relativeDifference(reduced, solved.solution), 100 * (length(solved.solution) / length(frames) - 1)));
  }
}

void compare(Report& report, const DataSet& set, std::size_t from, std::size_t to, int frames) {
  const double bending = defaultBending(set.shapes.front());
  const auto calculus = calculusOf(set, {bending, EnergySymmetry::kSymmetric});
  GeodesicFlowOptions options;
  options.frames = frames;
  options.ghost_vertices = set.topology->vertexCount();
  options.rough = std::min(frames, 17);
  options.enrichments = 12;
  options.accuracy = 1e-6;
  options.tolerance = 1e-8;
  const Stopwatch watch;
  const auto solved = geodesicByFlow(calculus.structure(), bending, set.shapes[from], set.shapes[to], options);
  const auto& reduced = solved.solution;
  const double seconds = watch.cpu();
  const Stopwatch full_watch;
  const auto full = calculus.interpolate(set.shapes[from], set.shapes[to], frames - 1, {});
  const double full_seconds = full_watch.cpu();
  const double longer =
      lengthOf(*set.topology, bending, reduced.curve) / lengthOf(*set.topology, bending, {full.solution, false}) - 1;
  const double difference = relativeDifference(reduced.curve, full.solution);
  report.entry(
      text("%s %zu -> %zu, %d shapes of %d vertices: length, reduced over full; difference; subspace; missing; "
           "CPU s reduced, full; %s, %s",
           set.name.c_str(), from, to, frames, set.topology->vertexCount(), name(solved.termination).data(),
           name(full.termination).data()),
      text("%+.4f %%; %.1e; %ld; %.0e; %.1f, %.1f", 100 * longer, difference, static_cast<long>(reduced.dimension),
           reduced.missing, seconds, full_seconds),
      "0.1 %; 1e-5", std::abs(longer) <= 1e-3 && difference <= 1e-5);
  stability(report, calculus, text("%s %zu -> %zu, %d shapes", set.name.c_str(), from, to, frames), reduced.curve);
}

/// The norm of the difference of two curves after the best rigid fit of each pair of shapes, over the norm of the
/// reference, as in Table 2; and the same of what remains of it without its part along the reference: two runners on
/// one way differ by the first alone.
std::pair<double, double> differences(const Curve& curve, const Curve& reference) {
  double squares = 0, across = 0, norms = 0;
  for (std::size_t i = 0; i < reference.size(); ++i) {
    const auto &shape = curve.frames[i], &target = reference.frames[i];
    const auto fitted = [&](const Vertices& other) -> Vertices { return apply(alignRigidly(other, target), other); };
    const Vertices difference = fitted(shape) - target;
    squares += difference.squaredNorm();
    norms += (target.rowwise() - target.colwise().mean()).squaredNorm();
    if (i == 0 || i + 1 == reference.size()) continue;
    const Vertices along = fitted(reference.frames[i + 1]) - fitted(reference.frames[i - 1]);
    const double share = difference.cwiseProduct(along).sum() / along.squaredNorm();
    across += (difference - share * along).squaredNorm();
  }
  return {std::sqrt(squares / norms), std::sqrt(across / norms)};
}

/// Geodesics by averages (1) and (10), from the same start in the same space, of the first `share` of the way between
/// two shapes.
void compareAverages(Report& report, const DataSet& set, std::size_t from, std::size_t to, double share) {
  const double bending = defaultBending(set.shapes.front());
  const auto structure = std::make_shared<const ShellStructure>(set.topology);
  GeodesicFlowOptions options;
  options.frames = 33;
  const auto whole = geodesicByFlow(structure, bending, set.shapes[from], set.shapes[to], options);
  const auto& end = whole.solution.curve.frames[static_cast<std::size_t>(std::lround(32 * share))];
  options.tolerance = 1e-7;
  const auto both = geodesicByFlow(structure, bending, set.shapes[from], end, options);
  options.solver = PathSolver::kFlow;
  options.symmetry = EnergySymmetry::kDirected;
  options.steps = 4000;
  const auto one = geodesicByFlow(structure, bending, set.shapes[from], end, options);
  const auto [difference, across] = differences(one.solution.curve, both.solution.curve);
  report.entry(
      text("%s %zu -> %zu, %g of the way, 33 shapes: averages (10) against (1); across the curve; lengths; %s, %s",
           set.name.c_str(), from, to, share, name(one.termination).data(), name(both.termination).data()),
      text("%.1e; %.1e; %.4f, %.4f", difference, across, lengthOf(*set.topology, bending, one.solution.curve),
           lengthOf(*set.topology, bending, both.solution.curve)),
      "<= 1e-4", difference <= 1e-4);
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

struct Clip {
  TopologyPtr topology;
  Curve curve;
};

/// On `vertices` of its vertices.
Clip coarser(const Clip& clip, int vertices) {
  std::vector<Vertices> chosen;
  for (std::size_t i = 0; i < clip.curve.size(); i += 20) chosen.push_back(clip.curve.frames[i]);
  CoarseningOptions options;
  options.vertex_count = vertices;
  const auto coarsening = coarsen(clip.topology, chosen, options);
  Clip coarse{coarsening.coarse, {{}, false}};
  for (const auto& frame : clip.curve.frames) coarse.curve.frames.push_back(restrictTo(coarsening, frame));
  return coarse;
}

/// Every triangle in four, by the middles of its edges.
Clip finer(const Clip& clip) {
  const auto& topology = *clip.topology;
  const auto count = topology.vertexCount();
  const auto& faces = topology.faces();
  Faces fine(4 * faces.rows(), 3);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    // faceEdges()[f][k] lies opposite to corner k
    const auto& edges = topology.faceEdges()[static_cast<std::size_t>(f)];
    const auto middle = [&](std::size_t k) { return count + static_cast<std::int32_t>(edges[k]); };
    fine.row(4 * f) << faces(f, 0), middle(2), middle(1);
    fine.row(4 * f + 1) << middle(2), faces(f, 1), middle(0);
    fine.row(4 * f + 2) << middle(1), middle(0), faces(f, 2);
    fine.row(4 * f + 3) << middle(0), middle(1), middle(2);
  }
  const auto edges = static_cast<Eigen::Index>(topology.edges().size());
  Clip result{std::make_shared<const Topology>(static_cast<std::int32_t>(count + edges), fine), {{}, false}};
  for (const auto& frame : clip.curve.frames) {
    Vertices shape(count + edges, 3);
    shape.topRows(count) = frame;
    for (Eigen::Index f = 0; f < faces.rows(); ++f)
      for (std::size_t k = 0; k < 3; ++k) {
        const auto a = faces(f, static_cast<Eigen::Index>((k + 1) % 3)),
                   b = faces(f, static_cast<Eigen::Index>((k + 2) % 3));
        shape.row(count + topology.faceEdges()[static_cast<std::size_t>(f)][k]) = 0.5 * (frame.row(a) + frame.row(b));
      }
    result.curve.frames.push_back(std::move(shape));
  }
  return result;
}

/// Median seconds of a step.
double smoothing(Report& report, const Clip& clip, int steps, AverageMethod method = AverageMethod::kBfgs) {
  const Stopwatch preparing;
  ReducedCurveOptions options;
  options.method = method;
  const ReducedCurve reduced(clip.topology, defaultBending(clip.curve.frames.front()), clip.curve, options);
  auto flow = reduced.flow({});
  const double prepared = preparing.wall(), prepared_cpu = preparing.cpu();
  std::vector<double> wall, cpu;
  int falls = 0;
  for (int k = 0; k < steps; ++k) {
    const double before = flow.pathEnergy();
    const Stopwatch watch;
    falls += flow.step().converged() && flow.pathEnergy() < before ? 1 : 0;
    wall.push_back(watch.wall());
    cpu.push_back(watch.cpu());
  }
  report.entry(
      text("%zu frames of %d vertices, subspace %ld, ghost of %d, %s: preparing; a step, median of %d; it falls",
           clip.curve.size(), clip.topology->vertexCount(), static_cast<long>(reduced.space().dimension()),
           reduced.space().topology()->vertexCount(), method == AverageMethod::kBfgs ? "BFGS" : "Newton", steps),
      text("%.2f s, %.2f CPU s; %.3f s, %.3f CPU s; %d of %d", prepared, prepared_cpu, median(wall), median(cpu), falls,
           steps),
      "<= 0.10 s; all", median(wall) <= 0.1 && falls == steps);
  return median(cpu);
}

void resolutions(Report& report) {
  const Clip clip{bodies().topology, longClip()};
  std::vector<double> seconds{smoothing(report, coarser(clip, 1709), 20), smoothing(report, clip, 30),
                              smoothing(report, finer(clip), 20)};
  smoothing(report, clip, 20, AverageMethod::kNewton);
  const auto [least, most] = std::minmax_element(seconds.begin(), seconds.end());
  report.entry("the CPU time of a step at the three resolutions, largest over smallest", text("%.2f", *most / *least),
               "<= 1.5", *most <= 1.5 * *least);
}

/// From the first of two shapes to the other.
void longGeodesic(Report& report, const DataSet& set, int frames, const char* target, double limit) {
  GeodesicFlowOptions options;
  options.frames = frames;
  const Stopwatch watch;
  const auto structure = std::make_shared<const ShellStructure>(set.topology);
  const auto flow =
      geodesicByFlow(structure, defaultBending(set.shapes.front()), set.shapes[0], set.shapes[1], options);
  const double wall = watch.wall();
  double ratio = 1;
  for (const auto& frame : flow.solution.curve.frames)
    ratio = std::min(ratio, smallestAreaRatio(set.topology->faces(), set.shapes[0], frame));
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
  const auto cacti = coarsened(cactus(), 2000);
  for (const double share : {1., 0.5, 0.25, 0.125}) {
    compareAverages(report, small, 3, 20, share);
    compareAverages(report, horses, 10, 20, share);
    compareAverages(report, cacti, 0, 2, share);
  }
  resolutions(report);
  longGeodesic(report, subset(coarsened(bodies(), 2000), {3, 20}), 64, "<= 1.5 s", 1.5);
  longGeodesic(report, subset(bodies(), {3, 20}), 256, "<= 15 s", 15);
  const auto poses = subset(bodies(), {3, 20});
  const auto fine = finer({poses.topology, {poses.shapes, false}});
  const DataSet finest{poses.name, fine.topology, fine.curve.frames};
  longGeodesic(report, coarsened(finest, 40'000), 256, "<= 15 s", 15);
  longGeodesic(report, finest, 256, "", 15);
}

}  // namespace shaped::experiments
