#include <cmath>

#include "core/shell/energy.h"
#include "core/statistics/gram.h"
#include "tests/benchmark/experiments/data.h"
#include "tests/benchmark/experiments/experiment.h"
#include "tests/benchmark/experiments/timing.h"

namespace shaped::experiments {
namespace {

constexpr int kSteps[] = {2, 4, 8, 16};

struct Observation {
  Eigen::MatrixXd gram;         ///< (11)
  Eigen::VectorXd eigenvalues;  ///< n - 1, without the one that is zero
};

Observation observe(const GeodesicCalculus& calculus, const std::vector<Vertices>& shapes, int steps,
                    Outcome& outcome) {
  FrechetMeanOptions options;
  options.path_steps = steps;
  const auto spider = frechetMean(calculus, shapes, options);
  outcome += spider;
  const auto gram = gramMatrix(calculus, spider.solution);
  return {gram, spectrum(gram).values.head(gram.rows() - 1)};
}

/// Slope of the least-squares line through log(error) over log(1 / K).
double slope(const std::vector<double>& errors) {
  double xx = 0, xy = 0, x_mean = 0, y_mean = 0;
  const auto n = static_cast<double>(errors.size());
  for (std::size_t i = 0; i < errors.size(); ++i) {
    x_mean -= std::log(kSteps[i]) / n;
    y_mean += std::log(errors[i]) / n;
  }
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const double x = -std::log(kSteps[i]) - x_mean;
    xx += x * x;
    xy += x * (std::log(errors[i]) - y_mean);
  }
  return xy / xx;
}

double relativeRms(const Eigen::MatrixXd& value, const Eigen::MatrixXd& reference) {
  return (value - reference).norm() / reference.norm();
}

void reportErrors(Report& report, const std::string& what, const std::vector<Eigen::MatrixXd>& values) {
  std::vector<double> errors;
  for (int i = 0; i < 3; ++i) errors.push_back(relativeRms(values[static_cast<std::size_t>(i)], values[3]));
  const double order = slope(errors);
  report.entry(what + ": relative RMS error at K = 2, 4, 8 against 16",
               text("%.2e, %.2e, %.2e", errors[0], errors[1], errors[2]));
  report.entry(what + ": slope", text("%.2f", order), ">= 1.8", order >= 1.8);
  const double first = (values[1] - values[0]).norm(), second = (values[2] - values[1]).norm(),
               third = (values[3] - values[2]).norm();
  report.entry(what + ": order from successive differences, K = 2, 4, 8 and K = 4, 8, 16",
               text("%.2f and %.2f", std::log2(first / second), std::log2(second / third)));
}

void convergenceInSteps(Report& report, const DataSet& set, EnergySymmetry symmetry) {
  const auto calculus = calculusOf(set, {defaultBending(set.shapes.front()), symmetry});
  Outcome outcome;
  std::vector<Eigen::MatrixXd> grams, eigenvalues;
  const Stopwatch watch;
  for (const int steps : kSteps) {
    auto observation = observe(calculus, set.shapes, steps, outcome);
    grams.push_back(std::move(observation.gram));
    eigenvalues.push_back(observation.eigenvalues);
  }
  const std::string which =
      text("%zu shapes of %s on %ld vertices, %s energy", set.shapes.size(), set.name.c_str(),
           static_cast<long>(set.shapes[0].rows()), symmetry == EnergySymmetry::kSymmetric ? "symmetric" : "directed");
  report.entry(which + ": Frechet means",
               text("%s, largest residual %.1e, CPU s of all four %.0f", name(outcome.termination).data(),
                    outcome.residual, watch.cpu()),
               "converged", outcome.converged());
  reportErrors(report, which + ", Gram entries", grams);
  reportErrors(report, which + ", eigenvalues", eigenvalues);
}

}  // namespace

void row4PathSteps() {
  Report report("Row 4: convergence in the number of path steps");
  const auto body = coarsened(subset(bodies1k(), {0, 8, 16, 24, 32, 40, 48, 56, 64}), 500);
  const auto cacti = coarsened(subset(cactus(), {0, 2, 4, 6, 8, 10, 12, 14, 16, 18}), 500);
  for (const auto symmetry : {EnergySymmetry::kSymmetric, EnergySymmetry::kDirected})
    for (const auto& set : {body, cacti}) convergenceInSteps(report, set, symmetry);
}

}  // namespace shaped::experiments
