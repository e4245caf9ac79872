#include "core/model/shell_pga_tasks.h"
#include "tests/benchmark/experiments/experiment.h"
#include "tests/benchmark/experiments/models.h"
#include "tests/benchmark/experiments/timing.h"

namespace shaped::experiments {

void row6Projection() {
  const auto set = bodies();
  std::vector<std::size_t> seen, unseen;
  for (std::size_t i = 0; i < set.shapes.size(); ++i) (heldOut(i) ? unseen : seen).push_back(i);
  const auto model = keptOrTrained(kMostBodies, subset(set, seen), 20);
  const OneThread one_thread;
  Report report("Row 6: projection of 12 unseen poses, model of the other 60");
  double last_energy = std::numeric_limits<double>::infinity();
  for (const int modes : {5, 10, 20}) {
    double energy = 0, smallest_area_ratio = 1;
    std::size_t converged = 0;
    std::vector<double> seconds;
    for (const auto i : unseen) {
      const Stopwatch watch;
      const auto projection = project(*model, set.shapes[i], {modes, false, {}});
      seconds.push_back(watch.cpu());
      energy += projection.solution.residual_energy / static_cast<double>(unseen.size());
      smallest_area_ratio = std::min(smallest_area_ratio, projection.solution.smallest_area_ratio);
      converged += projection.converged();
    }
    const double slowest = *std::max_element(seconds.begin(), seconds.end());
    const std::string time = text("%.2f (slowest %.2f)", median(seconds), slowest);
    const std::string what = text("J = %d: CPU s each, median", modes);
    if (modes == 10)
      report.entry(what, time, "<= 1", slowest <= 1);
    else
      report.entry(what, time);
    report.entry(text("J = %d: mean residual energy W[s, P[s]], m^2", modes), text("%.5f", energy),
                 modes == 5 ? "" : "falls", energy < last_energy);
    report.entry(text("J = %d: converged; smallest area ratio", modes),
                 text("%zu of %zu; %.3f", converged, unseen.size(), smallest_area_ratio), "all",
                 converged == unseen.size());
    last_energy = energy;
  }
}

}  // namespace shaped::experiments
