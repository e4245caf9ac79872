#include <cmath>

#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/model/shell_pga_evaluation.h"
#include "core/shell/energy.h"
#include "core/statistics/linear_pca.h"
#include "tests/benchmark/experiments/experiment.h"
#include "tests/benchmark/experiments/models.h"
#include "tests/benchmark/experiments/timing.h"

namespace shaped::experiments {
namespace {

void reportDimension(Report& report, const std::string& which, const GeneralisationError& ours,
                     const GeneralisationError& linear) {
  report.entry(which + ": elastic distance, ours and linear", text("%.4g and %.4g", ours.elastic, linear.elastic),
               "ours lower", ours.elastic < linear.elastic);
  report.entry(which + ": RMS vertex distance, ours and linear", text("%.4g and %.4g", ours.vertex, linear.vertex),
               "ours lower", ours.vertex < linear.vertex);
}

void compare(Report& report, const ShellPgaModel& model, const DataSet& set, std::vector<int> modes, int folds) {
  EvaluationOptions options;
  options.modes = std::move(modes);
  options.folds = folds;
  options.specificity_samples = 0;
  const Stopwatch watch;
  const auto solved = evaluate(model, set.shapes, options, {});
  const auto& evaluation = solved.solution;
  const std::string folds_text = folds == 0 ? "leave one out" : text("%d folds", folds);
  report.entry(
      text("%s: %zu shapes, %s", set.name.c_str(), set.shapes.size(), folds_text.c_str()),
      text("%s, largest residual %.1e, CPU s %.0f", name(solved.termination).data(), solved.residual, watch.cpu()));
  for (std::size_t m = 0; m < evaluation.modes.size(); ++m) {
    reportDimension(report, text("%s, dimension %d", set.name.c_str(), evaluation.modes[m]),
                    evaluation.generalisation[m], evaluation.linear[m]);
  }
}

ShellPgaModelPtr modelOf(const DataSet& set, int modes) {
  return keptOrTrained(set.name + "-" + std::to_string(set.shapes.size()), set, modes);
}

GeneralisationError errorOf(const GeodesicCalculus& calculus, const Vertices& shape, const Vertices& model_shape) {
  return {std::sqrt(shellEnergy(calculus.topology(), shape, model_shape, calculus.bending())),
          rmsVertexDistance(apply(alignRigidly(model_shape, shape), model_shape), shape)};
}

/// One fold: a model of five sixths of the shapes, errors on every sixth. As evaluate(), at a sixth of its time.
void compareOneFold(Report& report, const ShellPgaModel& model, const DataSet& set,
                    const std::vector<int>& dimensions) {
  std::vector<Vertices> seen, unseen;
  for (std::size_t i = 0; i < set.shapes.size(); ++i)
    (heldOut(i) ? unseen : seen).push_back(model.restrict(set.shapes[i], "shape"));
  const auto linear = linearPca(seen);
  const auto count = static_cast<double>(unseen.size());
  for (const int dimension : dimensions) {
    GeneralisationError ours, theirs;
    std::size_t converged = 0;
    for (const auto& shape : unseen) {
      SubmanifoldOptions options;
      options.modes = dimension;
      const auto projected = model.submanifold().project(shape, options);
      converged += projected.converged();
      const auto our_error = errorOf(model.coarseCalculus(), shape, projected.solution.shape);
      const auto their_error = errorOf(model.coarseCalculus(), shape, projectLinearly(linear, shape, dimension));
      ours.elastic += our_error.elastic / count, ours.vertex += our_error.vertex / count;
      theirs.elastic += their_error.elastic / count, theirs.vertex += their_error.vertex / count;
    }
    reportDimension(
        report,
        text("%s, %zu unseen of %zu, dimension %d", set.name.c_str(), unseen.size(), set.shapes.size(), dimension),
        ours, theirs);
    report.entry(set.name + text(", dimension %d: projections converged", dimension),
                 text("%zu of %zu", converged, unseen.size()));
  }
}

DataSet seenOf(const DataSet& set) {
  std::vector<std::size_t> seen;
  for (std::size_t i = 0; i < set.shapes.size(); ++i)
    if (!heldOut(i)) seen.push_back(i);
  return subset(set, seen);
}

}  // namespace

void row7Generalisation() {
  Report report("Row 7: generalisation to shapes left out, against linear PCA of aligned vertices");
  const auto body = bodies();
  compareOneFold(report, *keptOrTrained(kMostBodies, seenOf(body), 20), body, {1, 2, 5, 10, 20});
  const auto horses = horse();
  compareOneFold(report, *keptOrTrained("horse-63", seenOf(horses), 20), horses, {1, 2, 5, 10, 20});
  const auto cacti = cactus();
  compare(report, *modelOf(cacti, 16), cacti, {1, 2, 4, 8, 16}, 0);
}

}  // namespace shaped::experiments
