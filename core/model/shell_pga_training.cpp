#include "core/model/shell_pga_training.h"

#include "core/io/sha256.h"
#include "core/io/text_scanner.h"
#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/shell/energy.h"

namespace shaped {
namespace {

void requireShapes(const ShellPgaTrainingSet& set) {
  requireOneComponent(*set.topology, "topology");
  if (set.shapes.size() < 2)
    throw InvalidInput("shapes",
                       "has " + std::to_string(set.shapes.size()) + ", a model needs at least two training shapes");
  for (std::size_t i = 0; i < set.shapes.size(); ++i)
    requireValidShape(*set.topology, set.shapes[i], "shapes[" + std::to_string(i) + "]");
  if (set.template_shape) requireValidShape(*set.topology, *set.template_shape, "template");
}

/// Two shapes alike up to a rigid motion carry no second observation and leave the Gram matrix without meaning.
void requireDistinct(const std::vector<Vertices>& coarse, const std::stop_token& stop) {
  const double size = boundingBoxDiagonal(coarse.front());
  for (std::size_t i = 0; i < coarse.size(); ++i)
    for (std::size_t j = 0; j < i && !stop.stop_requested(); ++j)
      if (rmsVertexDistance(apply(alignRigidly(coarse[i], coarse[j]), coarse[i]), coarse[j]) < 1e-7 * size)
        throw InvalidInput("shapes[" + std::to_string(i) + "]",
                           "is shapes[" + std::to_string(j) + "] up to a rigid motion; remove one of them");
}

/// The training shape nearest to the mean lends its detail. Any of them once the stop token has fired.
std::size_t nearestToMean(const GeodesicCalculus& calculus, const Spider& spider, const std::stop_token& stop) {
  std::size_t nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < spider.arms.size() && !stop.stop_requested(); ++i) {
    const double energy = calculus.pathEnergy(spider.arms[i]);
    if (energy < least) least = energy, nearest = i;
  }
  return nearest;
}

ProgressSink within(const ProgressSink& sink, double from, double to) {
  if (!sink) return {};
  return [sink, from, to](const Progress& p) { sink({p.stage, from + (to - from) * p.fraction, p.residual}); };
}

void report(const ProgressSink& sink, const std::string& stage, double fraction) {
  if (sink) sink({stage, fraction, 0});
}

void hashShape(const Vertices& shape, Sha256& hash) {
  hash.update({reinterpret_cast<const char*>(shape.data()), static_cast<std::size_t>(shape.size()) * sizeof(double)});
}

/// The Frechet mean, begun or resumed; counts the Newton steps of all processes together.
Solved<Spider> trainMean(const GeodesicCalculus& calculus, const std::vector<Vertices>& coarse,
                         const ShellPgaTrainingOptions& options, ShellPgaCheckpoint& state,
                         const CheckpointSink& checkpoint, const ProgressSink& progress, const std::stop_token& stop) {
  if (state.mean_ended) return {*state.spider, state.mean};
  const int before = state.mean.iterations;
  const auto soFar = [before](Outcome outcome) { return outcome.iterations += before, outcome; };
  FrechetMeanOptions mean_options{options.path_steps,
                                  options.iterations - before,
                                  options.tolerance,
                                  stop,
                                  within(progress, 0.1, 0.75),
                                  state.spider ? &*state.spider : nullptr,
                                  {}};
  if (checkpoint)
    mean_options.on_iterate = [&](const Outcome& outcome, const std::function<Spider()>& iterate) {
      checkpoint(
          [&] { return ShellPgaCheckpoint{state.training, state.coarsening, iterate(), soFar(outcome), false, {}}; });
    };
  auto mean = frechetMean(calculus, coarse, mean_options);
  return {std::move(mean.solution), soFar(mean)};
}

/// The principal variations, begun or resumed; every item that is done is offered.
Solved<ShellPga> trainVariations(const GeodesicCalculus& calculus, const Spider& spider, int modes,
                                 ShellPgaCheckpoint& state, const CheckpointSink& checkpoint,
                                 const ProgressSink& progress, const std::stop_token& stop) {
  const auto from = std::move(state.variations);
  const auto on_item = [&](const VariationsProgress& done) {
    report(progress, stageOf(done), 0.75 + 0.15 * shareOf(done));
    if (!checkpoint) return;
    checkpoint([&] {
      auto reached = state;
      reached.variations = done;
      return reached;
    });
  };
  return principalVariations(calculus, spider, modes, {100, 1e-8, stop}, {&from, on_item});
}

}  // namespace

std::string trainingFingerprint(const ShellPgaTrainingSet& set, const ShellPgaTrainingOptions& options) {
  Sha256 hash;
  hash.update(set.topology->id());
  for (const double number :
       {static_cast<double>(options.modes), static_cast<double>(options.path_steps), options.bending.value_or(0),
        static_cast<double>(options.symmetry == EnergySymmetry::kSymmetric),
        static_cast<double>(options.coarse_vertices), options.tolerance, static_cast<double>(options.iterations)})
    hash.update(shortest(number) + " ");
  for (const auto& shape : set.shapes) hashShape(shape, hash);
  if (set.template_shape) hashShape(*set.template_shape, hash);
  return hash.finish();
}

std::optional<std::string> ShellPgaTrainingOptions::firstViolation(int training_shapes) const {
  if (modes < 1 || modes > training_shapes - 1)
    return "modes = " + std::to_string(modes) + ", want 1 to " + std::to_string(training_shapes - 1) +
           ", one less than the " + std::to_string(training_shapes) + " training shapes";
  if (path_steps < 1) return "path_steps = " + std::to_string(path_steps) + ", want >= 1";
  if (bending && !(*bending > 0)) return "bending = " + std::to_string(*bending) + ", want > 0";
  if (coarse_vertices < 50) return "coarse_vertices = " + std::to_string(coarse_vertices) + ", want >= 50";
  if (!(tolerance > 0)) return "tolerance = " + std::to_string(tolerance) + ", want > 0";
  if (iterations < 1) return "iterations = " + std::to_string(iterations) + ", want >= 1";
  return std::nullopt;
}

Solved<ShellPgaModelPtr> trainShellPga(const ShellPgaTrainingSet& set, const ShellPgaTrainingOptions& options,
                                       const ProgressSink& progress, std::stop_token stop,
                                       const ShellPgaResumption& resumption) {
  requireShapes(set);
  if (const auto violation = options.firstViolation(static_cast<int>(set.shapes.size())))
    throw InvalidInput("options", *violation);
  ShellPgaCheckpoint state{trainingFingerprint(set, options), {}, {}, {}, false, {}};
  if (resumption.from && resumption.from->training != state.training)
    throw InvalidInput("checkpoint", "is of another training");
  if (resumption.from) state = *resumption.from;
  const auto keep = [&] {
    if (resumption.checkpoint) resumption.checkpoint([&] { return state; });
  };

  report(progress, "coarsening", 0);
  ShellPgaParts parts;
  parts.topology = set.topology;
  parts.template_shape = set.template_shape.value_or(set.shapes.front());
  parts.symmetry = options.symmetry;
  parts.bending = options.bending.value_or(defaultBending(set.shapes.front()));
  if (!resumption.from) state.coarsening = coarsen(set.topology, set.shapes, {options.coarse_vertices, {}, stop});
  const Outcome cancelled{Termination::kCancelled, 0, 0};
  if (stop.stop_requested()) return {nullptr, cancelled};
  keep();
  parts.coarsening = state.coarsening;
  std::vector<Vertices> coarse;
  for (std::size_t i = 0; i < set.shapes.size(); ++i) {
    coarse.push_back(restrictTo(parts.coarsening, set.shapes[i]));
    requireValidShape(*parts.coarsening.coarse, coarse.back(), "shapes[" + std::to_string(i) + "] on the coarse mesh");
  }
  requireDistinct(coarse, stop);

  const auto structure = ShellStructure::make(parts.coarsening.coarse, stop);
  if (!structure) return {nullptr, cancelled};
  const auto calculus = std::make_shared<const GeodesicCalculus>(structure, PairEnergy(parts.bending, parts.symmetry));
  const auto spider = trainMean(*calculus, coarse, options, state, resumption.checkpoint, progress, stop);
  parts.training = {static_cast<int>(set.shapes.size()), spider, {}, 0};
  if (spider.termination == Termination::kCancelled) return {nullptr, cancelled};
  state.spider = spider.solution;
  state.mean = spider;
  state.mean_ended = true;
  keep();
  if (stop.stop_requested()) return {nullptr, cancelled};
  report(progress, "principal variations", 0.75);
  auto pga = trainVariations(*calculus, spider.solution, options.modes, state, resumption.checkpoint, progress, stop);
  if (stop.stop_requested()) return {nullptr, cancelled};
  parts.training.variations = pga;
  parts.pga = std::move(pga.solution);

  report(progress, "prolongation", 0.9);
  parts.reference = set.shapes[nearestToMean(*calculus, spider.solution, stop)];
  auto prolongation = Prolongation::learn(set.topology, parts.coarsening, parts.reference, set.shapes, stop);
  if (!prolongation) return {nullptr, cancelled};
  parts.detail = prolongation->detail();
  const Outcome outcome = parts.training.combined();
  report(progress, "done", 1);
  return {std::make_shared<const ShellPgaModel>(std::move(parts), calculus, std::move(prolongation)), outcome};
}

}  // namespace shaped
