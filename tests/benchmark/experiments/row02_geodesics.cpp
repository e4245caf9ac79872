#include <algorithm>
#include <random>

#include "tests/benchmark/experiments/data.h"
#include "tests/benchmark/experiments/experiment.h"
#include "tests/benchmark/experiments/timing.h"

namespace shaped::experiments {
namespace {

using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

Pairs fromFirst(const DataSet& set) {
  Pairs pairs;
  for (std::size_t i = 1; i < set.shapes.size(); ++i) pairs.emplace_back(0, i);
  return pairs;
}

/// Different ordered pairs, the same ones on every machine.
Pairs randomPairs(const DataSet& set, std::size_t count) {
  std::mt19937 random(2);
  Pairs pairs;
  while (pairs.size() < count) {
    const std::pair<std::size_t, std::size_t> pair(random() % set.shapes.size(), random() % set.shapes.size());
    if (pair.first != pair.second && std::find(pairs.begin(), pairs.end(), pair) == pairs.end()) pairs.push_back(pair);
  }
  return pairs;
}

void runPairs(Report& report, const DataSet& set, const std::string& which, const Pairs& pairs) {
  const auto calculus = calculusOf(set);
  std::size_t converged = 0;
  double largest_residual = 0, largest_ratio = 1;
  std::vector<double> seconds, iterations;
  for (const auto& [from, to] : pairs) {
    const Stopwatch watch;
    const auto geodesic = calculus.interpolate(set.shapes[from], set.shapes[to], 4, {});
    seconds.push_back(watch.cpu());
    iterations.push_back(geodesic.iterations);
    const auto speeds = calculus.segmentEnergies(geodesic.solution);
    const double ratio =
        *std::max_element(speeds.begin(), speeds.end()) / *std::min_element(speeds.begin(), speeds.end());
    if (geodesic.converged())
      ++converged;
    else
      report.entry(text("%s %zu -> %zu", set.name.c_str(), from, to),
                   text("%s after %d iterations, relative gradient %.1e", name(geodesic.termination).data(),
                        geodesic.iterations, geodesic.residual));
    largest_residual = std::max(largest_residual, geodesic.residual);
    largest_ratio = std::max(largest_ratio, ratio);
  }
  report.entry(text("%s (%ld vertices), %s: converged", set.name.c_str(), static_cast<long>(set.shapes[0].rows()),
                    which.c_str()),
               text("%zu of %zu", converged, pairs.size()), "all", converged == pairs.size());
  report.entry(set.name + ": largest relative gradient", text("%.1e", largest_residual), "<= 1e-8",
               largest_residual <= 1e-8);
  report.entry(set.name + ": largest ratio of segment energies along a path", text("%.4f", largest_ratio));
  report.entry(set.name + ": CPU s a pair, median (slowest); Newton steps, median (most)",
               text("%.2f (%.2f); %.0f (%.0f)", median(seconds), *std::max_element(seconds.begin(), seconds.end()),
                    median(iterations), *std::max_element(iterations.begin(), iterations.end())));
}

}  // namespace

void row2Geodesics() {
  const OneThread one_thread;
  Report report("Row 2: every K = 4 geodesic converges");
  const auto body = bodies1k();
  runPairs(report, body, "60 random pairs", randomPairs(body, 60));
  const auto cacti = cactus();
  runPairs(report, cacti, "0 -> i", fromFirst(cacti));
  const auto horses = horse();
  runPairs(report, horses, "40 random pairs", randomPairs(horses, 40));
  const auto cows = cow();
  runPairs(report, cows, "rest -> i", fromFirst(cows));
}

}  // namespace shaped::experiments
