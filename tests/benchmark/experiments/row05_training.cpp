#include <sys/resource.h>
#include <tbb/global_control.h>

#include "tests/benchmark/experiments/experiment.h"
#include "tests/benchmark/experiments/models.h"
#include "tests/benchmark/experiments/timing.h"

namespace shaped::experiments {
namespace {

double peakGibibytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / (1024.0 * 1024.0);
}

}  // namespace

void row5Training() {
  const tbb::global_control two_threads(tbb::global_control::max_allowed_parallelism, 2);
  Report report("Row 5: training on 72 poses of 13,380 vertices (K = 4, J = 20, 1000 coarse vertices)");
  const auto set = bodies();
  const Stopwatch watch;
  const auto trained = train(set, 20);
  const double wall = watch.wall(), cpu = watch.cpu();
  if (!trained.solution) throw std::runtime_error("training ended with " + std::string(name(trained.termination)));
  const auto& record = trained.solution->parts().training;
  report.entry("largest relative force imbalance of the mean",
               text("%.1e (%s, %d Newton steps)", record.mean.residual, name(record.mean.termination).data(),
                    record.mean.iterations),
               "<= 1e-6", record.mean.residual <= 1e-6);
  report.entry(
      "principal variations",
      text("%s, largest residual %.1e", name(record.variations.termination).data(), record.variations.residual),
      "converged", record.variations.converged());
  report.entry("wall s, two threads", text("%.1f (CPU s of both threads: %.1f)", wall, cpu), "<= 180", wall <= 180);
  report.entry("peak resident memory of the process, GiB", text("%.2f", peakGibibytes()), "< 2", peakGibibytes() < 2);
  const Eigen::VectorXd variances = trained.solution->pga().eigenvalues.cwiseMax(0);
  report.entry("share of variance in J = 5, 10, 20",
               text("%.3f, %.3f, %.3f", variances.head(5).sum() / variances.sum(),
                    variances.head(10).sum() / variances.sum(), variances.head(20).sum() / variances.sum()));
  keep(kAllBodies, *trained.solution);
}

}  // namespace shaped::experiments
