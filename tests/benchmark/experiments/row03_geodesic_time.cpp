#include "tests/benchmark/experiments/data.h"
#include "tests/benchmark/experiments/experiment.h"
#include "tests/benchmark/experiments/timing.h"

namespace shaped::experiments {

void row3GeodesicTime() {
  const OneThread one_thread;
  Report report("Row 3: time of one K = 4 geodesic");
  constexpr double eta = 1e-3;
  const auto ends = subset(cactus(), {0, 2});
  for (const auto& [vertices, target] : {std::pair{500, 0.2}, {2000, 1.1}, {5261, 4.0}}) {
    const auto set = vertices < ends.shapes[0].rows() ? coarsened(ends, vertices) : ends;
    const Stopwatch analysis;
    const auto calculus = calculusOf(set, eta);
    const double analysed = analysis.cpu();
    std::vector<double> seconds;
    Solved<Path> geodesic;
    for (int repetition = 0; repetition < 5; ++repetition) {
      const Stopwatch watch;
      geodesic = calculus.interpolate(set.shapes[0], set.shapes[1], 4, {});
      seconds.push_back(watch.cpu());
    }
    const double time = median(seconds);
    report.entry(
        text("cactus0 -> cactus2 on %ld vertices, CPU s, median of 5", static_cast<long>(set.shapes[0].rows())),
        text("%.3f (%d Newton steps, %s; analysis once per topology %.3f)", time, geodesic.iterations,
             name(geodesic.termination).data(), analysed),
        text("<= %.1f", target), geodesic.converged() && time <= target);
  }
}

}  // namespace shaped::experiments
