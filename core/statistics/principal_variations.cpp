#include "core/statistics/principal_variations.h"

#include <tbb/parallel_for.h>

#include <mutex>

#include "core/numerics/error.h"
#include "core/shell/shell_objective.h"

namespace shaped {
namespace {

using Shapes = std::vector<std::optional<Solved<Vertices>>>;

/// The items of a computation: fills in the missing ones in parallel and tells of each.
class Items {
 public:
  Items(std::size_t shapes, std::size_t modes, const VariationsResumption& resumption, std::stop_token stop)
      : on_item_(resumption.on_item), stop_(std::move(stop)) {
    if (resumption.from) done_ = *resumption.from;
    done_.gram_rows.resize(shapes);
    done_.reflected.resize(shapes);
    done_.forward.resize(modes);
    done_.backward.resize(modes);
  }

  const VariationsProgress& done() const { return done_; }
  bool stopped() const { return stop_.stop_requested(); }

  /// compute(i) makes an item, keep(i, item) stores it. What came of a solver that was stopped is no item.
  template <class Member, class Compute, class Keep>
  void fill(const Member& member, const Compute& compute, const Keep& keep) {
    tbb::parallel_for(std::size_t{0}, member(done_).size(), [&](std::size_t i) {
      if (stopped() || isThere(member, i)) return;
      auto item = compute(i);
      if (stopped()) return;
      const std::lock_guard lock(mutex_);
      keep(done_, i, std::move(item));
      if (on_item_) on_item_(done_);
    });
    if (stopped() && on_item_) on_item_(done_);
  }

 private:
  template <class Member>
  bool isThere(const Member& member, std::size_t i) {
    const std::lock_guard lock(mutex_);
    return member(done_)[i].has_value();
  }

  const std::function<void(const VariationsProgress&)>& on_item_;
  const std::stop_token stop_;
  std::mutex mutex_;
  VariationsProgress done_;
};

Outcome combine(const Shapes& shapes) {
  Outcome total;
  for (const auto& shape : shapes) total += *shape;
  return total;
}

std::vector<ShellMeasures> measuresOf(const GeodesicCalculus& calculus, const Shapes& shapes) {
  std::vector<ShellMeasures> measures(shapes.size());
  for (std::size_t i = 0; i < shapes.size(); ++i) measure(calculus.topology(), shapes[i]->solution, measures[i]);
  return measures;
}

void fillGramRows(const GramEnergies& energies, Items& items) {
  items.fill(
      [](auto& done) -> auto& { return done.gram_rows; }, [&](std::size_t i) { return energies.row(i); },
      [](auto& done, std::size_t i, Eigen::VectorXd row) { done.gram_rows[i] = std::move(row); });
}

/// I(mean, shape_i, -1/K) for every arm.
void fillReflected(const GeodesicCalculus& calculus, const Spider& spider, const GeodesicOptions& options,
                   Items& items) {
  items.fill(
      [](auto& done) -> auto& { return done.reflected; },
      [&](std::size_t i) { return calculus.extrapolateBackwards(spider.mean, spider.arms[i][1], options); },
      [](auto& done, std::size_t i, Solved<Vertices> shape) { done.reflected[i] = std::move(shape); });
}

Solved<Vertices> variation(const GeodesicCalculus& calculus, const Vertices& mean, const Eigen::VectorXd& weights,
                           const std::vector<ShellMeasures>& nodes, const std::vector<ShellMeasures>& reflected,
                           const GeodesicOptions& options) {
  ShellObjective objective(calculus.structure(), calculus.bending());
  const double total = weights.cwiseAbs().sum();
  for (Eigen::Index i = 0; i < weights.size(); ++i) {
    const auto row = static_cast<std::size_t>(i);
    objective.addUndeformed(weights[i] < 0 ? reflected[row] : nodes[row], std::abs(weights[i]) / total);
  }
  return minimiseShell(objective, *calculus.structure(), mean,
                       {options.max_iterations, options.tolerance, options.stop});
}

/// p_j and its reflection.
void fillVariations(const GeodesicCalculus& calculus, const Spider& spider, const Eigen::MatrixXd& eigenvectors,
                    const GeodesicOptions& options, Items& items) {
  std::vector<ShellMeasures> nodes(spider.arms.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) measure(calculus.topology(), spider.arms[i][1], nodes[i]);
  const auto reflected = measuresOf(calculus, items.done().reflected);
  using Pair = std::pair<Solved<Vertices>, Solved<Vertices>>;
  items.fill(
      [](auto& done) -> auto& { return done.backward; },
      [&](std::size_t j) -> Pair {
        auto forward =
            variation(calculus, spider.mean, eigenvectors.col(static_cast<Eigen::Index>(j)), nodes, reflected, options);
        auto backward = calculus.extrapolateBackwards(spider.mean, forward.solution, options);
        return {std::move(forward), std::move(backward)};
      },
      [](auto& done, std::size_t j, Pair pair) {
        done.forward[j] = std::move(pair.first);
        done.backward[j] = std::move(pair.second);
      });
}

}  // namespace

Solved<ShellPga> principalVariations(const GeodesicCalculus& calculus, const Spider& spider, int modes,
                                     const GeodesicOptions& options, const VariationsResumption& resumption) {
  const auto n = static_cast<int>(spider.arms.size());
  if (modes < 1 || modes > n - 1)
    throw InvalidInput("modes", std::to_string(modes) + ", want 1 to " + std::to_string(n - 1) +
                                    ", one less than the " + std::to_string(n) + " training shapes");
  Items items(spider.arms.size(), static_cast<std::size_t>(modes), resumption, options.stop);
  const Solved<ShellPga> cancelled({}, {Termination::kCancelled, 0, 0});
  const GramEnergies energies(calculus, spider);
  fillGramRows(energies, items);
  if (items.stopped()) return cancelled;
  fillReflected(calculus, spider, options, items);
  if (items.stopped()) return cancelled;
  std::vector<Eigen::VectorXd> rows;
  for (const auto& row : items.done().gram_rows) rows.push_back(*row);

  ShellPga pga;
  pga.mean = spider.mean;
  auto decomposition = spectrum(energies.matrix(rows));
  pga.eigenvalues = std::move(decomposition.values);
  pga.eigenvectors = decomposition.vectors.leftCols(modes);
  pga.path_steps = static_cast<int>(spider.arms.front().size()) - 1;
  fillVariations(calculus, spider, pga.eigenvectors, options, items);
  if (items.stopped()) return cancelled;

  const auto& done = items.done();
  Outcome outcome = combine(done.reflected);
  for (std::size_t j = 0; j < done.forward.size(); ++j) (outcome += *done.forward[j]) += *done.backward[j];
  std::vector<Vertices> variations;
  for (const auto* shapes : {&done.forward, &done.backward})
    for (const auto& shape : *shapes) variations.push_back(shape->solution);
  pga.variations = ShapeStack(variations);
  return {std::move(pga), outcome};
}

}  // namespace shaped
