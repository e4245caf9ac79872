#include <algorithm>

#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/model/shell_pga_evaluation.h"
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

void compare(Report& report, const ShellPgaModel& model, const DataSet& set, std::vector<int> modes) {
  EvaluationOptions options;
  options.modes = std::move(modes);
  options.specificity_samples = 0;
  const Stopwatch watch;
  const auto solved = evaluate(model, set.shapes, options, {});
  const auto& evaluation = solved.solution;
  report.entry(
      text("%s: %zu shapes, leave one out", set.name.c_str(), set.shapes.size()),
      text("%s, largest residual %.1e, CPU s %.0f", name(solved.termination).data(), solved.residual, watch.cpu()));
  for (std::size_t m = 0; m < evaluation.modes.size(); ++m) {
    reportDimension(report, text("%s, dimension %d", set.name.c_str(), evaluation.modes[m]),
                    evaluation.generalisation[m], evaluation.linear[m]);
  }
}

/// Without shapes that repeat an earlier one up to a rigid motion, which training refuses (two of the horse's poses
/// do).
DataSet distinct(const DataSet& set) {
  std::vector<std::size_t> kept;
  const double size = diameter(set.shapes.front());
  for (std::size_t i = 0; i < set.shapes.size(); ++i) {
    const auto& shape = set.shapes[i];
    const bool repeated = std::any_of(kept.begin(), kept.end(), [&](std::size_t k) {
      return rmsVertexDistance(apply(alignRigidly(shape, set.shapes[k]), shape), set.shapes[k]) < 1e-6 * size;
    });
    if (!repeated) kept.push_back(i);
  }
  return subset(set, kept);
}

ShellPgaModelPtr modelOf(const DataSet& set, int modes) {
  return keptOrTrained(set.name + "-" + std::to_string(set.shapes.size()), set, modes);
}

}  // namespace

void row7Generalisation() {
  Report report("Row 7: generalisation to shapes left out, against linear PCA of aligned vertices");
  for (const auto& set : {cactus(), bodies(), distinct(horse())}) {
    const int most = std::min(20, static_cast<int>(set.shapes.size()) - 3);
    std::vector<int> dimensions;
    for (const int d : {1, 2, 5, 10, 20})
      if (d < most) dimensions.push_back(d);
    dimensions.push_back(most);
    compare(report, *modelOf(set, most), set, dimensions);
  }
}

}  // namespace shaped::experiments
