#include "core/model/shell_pga_evaluation.h"
#include "tests/benchmark/experiments/experiment.h"
#include "tests/benchmark/experiments/models.h"
#include "tests/benchmark/experiments/timing.h"

namespace shaped::experiments {
namespace {

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
    const auto &ours = evaluation.generalisation[m], &linear = evaluation.linear[m];
    const std::string which = text("%s, dimension %d: ", set.name.c_str(), evaluation.modes[m]);
    report.entry(which + "elastic distance, ours and linear", text("%.4g and %.4g", ours.elastic, linear.elastic),
                 "ours lower", ours.elastic < linear.elastic);
    report.entry(which + "RMS vertex distance, ours and linear", text("%.4g and %.4g", ours.vertex, linear.vertex),
                 "ours lower", ours.vertex < linear.vertex);
  }
}

std::vector<std::size_t> everySecond(std::size_t count) {
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < count; i += 2) indices.push_back(i);
  return indices;
}

ShellPgaModelPtr modelOf(const DataSet& set, int modes) {
  return keptOrTrained(set.name + "-" + std::to_string(set.shapes.size()), set, modes);
}

}  // namespace

void row7Generalisation() {
  Report report("Row 7: generalisation to shapes left out, against linear PCA of aligned vertices");
  const auto cacti = cactus();
  compare(report, *modelOf(cacti, 16), cacti, {1, 2, 4, 8, 16}, 0);
  const auto all_horses = horse();
  const auto horses = subset(all_horses, everySecond(all_horses.shapes.size()));
  compare(report, *modelOf(horses, 20), horses, {1, 2, 5, 10, 20}, 8);
  const auto body = bodies();
  compare(report, *keptOrTrained(kAllBodies, body, 20), body, {1, 2, 5, 10, 20}, 8);
}

}  // namespace shaped::experiments
