#include "core/statistics/frechet_mean.h"

#include <tbb/parallel_for.h>

#include <atomic>
#include <mutex>

#include "core/geodesic/elastic_network.h"
#include "core/mesh/alignment.h"
#include "core/numerics/error.h"
#include "core/shell/energy.h"
#include "core/shell/shell_objective.h"

namespace shaped {
namespace {

/// Mean angles and mean logarithms of the lengths.
ShellMeasures averageMeasures(const std::vector<ShellMeasures>& all) {
  ShellMeasures mean = all.front();
  for (std::size_t i = 1; i < all.size(); ++i) mean = blendMeasures(mean, all[i], 1.0 / static_cast<double>(i + 1));
  return mean;
}

/// argmin over s of sum_i W[s_i, s].
Solved<Vertices> elasticAverage(const GeodesicCalculus& calculus, const std::vector<Vertices>& shapes,
                                const FrechetMeanOptions& options) {
  std::vector<ShellMeasures> measures(shapes.size());
  ShellObjective objective(calculus.structure(), calculus.bending());
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    measure(calculus.topology(), shapes[i], measures[i]);
    objective.addUndeformed(measures[i], 1.0 / static_cast<double>(shapes.size()));
  }
  Vertices start = calculus.reconstruction().reconstruct(averageMeasures(measures), shapes.front(), options.stop);
  if (start.rows() == 0 || !std::isfinite(objective.value(flatten(start)))) start = shapes.front();
  return minimiseShell(objective, *calculus.structure(), start, {100, 1e-4, options.stop});
}

class ProgressCounter {
 public:
  ProgressCounter(const ProgressSink& sink, std::string stage, double from, double to, std::size_t total)
      : sink_(sink), stage_(std::move(stage)), from_(from), to_(to), total_(total) {}
  void advance(double residual) {
    const std::lock_guard lock(mutex_);
    ++done_;
    if (sink_)
      sink_({stage_, from_ + (to_ - from_) * static_cast<double>(done_) / static_cast<double>(total_), residual});
  }

 private:
  const ProgressSink& sink_;
  std::string stage_;
  double from_, to_;
  std::size_t total_, done_ = 0;
  std::mutex mutex_;
};

/// Node 0 is the mean; arm i has nodes 1 + i K .. i K + K, the last being the fixed input.
ElasticNetwork buildSpider(const Vertices& mean, std::vector<Path> arms, int steps) {
  ElasticNetwork network;
  network.nodes.push_back(mean);
  network.free.push_back(true);
  const double weight = static_cast<double>(steps) / static_cast<double>(arms.size());
  for (auto& arm : arms) {
    std::int32_t inner = 0;
    for (int k = 1; k <= steps; ++k) {
      const auto node = static_cast<std::int32_t>(network.nodes.size());
      network.nodes.push_back(std::move(arm[static_cast<std::size_t>(k)]));
      network.free.push_back(k < steps);
      network.segments.push_back({node, inner, weight});
      inner = node;
    }
  }
  return network;
}

Spider spiderOf(ElasticNetwork network, std::size_t count, int steps) {
  Spider spider{std::move(network.nodes.front()), std::vector<Path>(count)};
  std::size_t node = 1;
  for (auto& arm : spider.arms) {
    arm.push_back(spider.mean);
    for (int k = 0; k < steps; ++k) arm.push_back(std::move(network.nodes[node++]));
  }
  return spider;
}

/// The elastic average with a rough geodesic to each input.
Spider startSpider(const GeodesicCalculus& calculus, const std::vector<Vertices>& shapes,
                   const FrechetMeanOptions& options) {
  Spider spider;
  spider.mean = elasticAverage(calculus, shapes, options).solution;
  spider.arms.resize(shapes.size());
  ProgressCounter counter(options.progress, "geodesics to the mean", 0, 0.3, shapes.size());
  tbb::parallel_for(std::size_t{0}, shapes.size(), [&](std::size_t i) {
    const Vertices moved = apply(alignRigidly(shapes[i], spider.mean), shapes[i]);
    // from the input to the mean, as the spider's segments run
    auto path = calculus.interpolate(moved, spider.mean, options.path_steps, {60, 1e-2, options.stop}).solution;
    spider.arms[i].assign(std::make_move_iterator(path.rbegin()), std::make_move_iterator(path.rend()));
    counter.advance(0);
  });
  return spider;
}

void requireFittingStart(const Spider& start, std::size_t shapes, int steps) {
  if (start.arms.size() != shapes)
    throw InvalidInput("start", "has " + std::to_string(start.arms.size()) + " arms, want one for each of the " +
                                    std::to_string(shapes) + " shapes");
  for (std::size_t i = 0; i < shapes; ++i)
    if (start.arms[i].size() != static_cast<std::size_t>(steps) + 1)
      throw InvalidInput("start.arms[" + std::to_string(i) + "]",
                         "has " + std::to_string(start.arms[i].size()) + " shapes, want " + std::to_string(steps + 1));
}

}  // namespace

Solved<Spider> frechetMean(const GeodesicCalculus& calculus, const std::vector<Vertices>& shapes,
                           const FrechetMeanOptions& options) {
  if (shapes.empty()) throw InvalidInput("shapes", "a mean needs at least one shape");
  if (options.path_steps < 1) throw InvalidInput("path_steps", std::to_string(options.path_steps) + ", want >= 1");
  for (std::size_t i = 0; i < shapes.size(); ++i)
    requireValidShape(calculus.topology(), shapes[i], "shapes[" + std::to_string(i) + "]");

  const int steps = options.path_steps;
  if (options.start) requireFittingStart(*options.start, shapes.size(), steps);
  Spider start = options.start ? *options.start : startSpider(calculus, shapes, options);
  for (std::size_t i = 0; i < shapes.size(); ++i) start.arms[i].back() = shapes[i];
  if (options.stop.stop_requested()) return {std::move(start), Outcome{Termination::kCancelled, 0, 1}};
  NetworkOptions network_options{options.max_iterations, options.tolerance, options.stop, {}, {}};
  if (options.progress)
    network_options.on_iteration = [&](int iteration, double residual) {
      const double fraction = 1 - 0.7 * std::pow(0.85, iteration);
      options.progress({"Frechet mean, Newton step " + std::to_string(iteration), fraction, residual});
    };
  if (options.on_iterate)
    network_options.on_iterate = [&](const Outcome& so_far, const ElasticNetwork& iterate) {
      options.on_iterate(so_far, [&] { return spiderOf(iterate, shapes.size(), steps); });
    };
  auto relaxed = relax(calculus.structure(), calculus.energy(), buildSpider(start.mean, std::move(start.arms), steps),
                       network_options);
  const Outcome outcome = relaxed;
  return {spiderOf(std::move(relaxed.solution), shapes.size(), steps), outcome};
}

}  // namespace shaped
