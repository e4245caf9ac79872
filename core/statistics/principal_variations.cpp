#include "core/statistics/principal_variations.h"

#include <tbb/parallel_for.h>

#include "core/numerics/error.h"
#include "core/shell/shell_objective.h"

namespace shaped {
namespace {

Outcome combine(const std::vector<Outcome>& outcomes) {
  Outcome total;
  for (const auto& outcome : outcomes) total += outcome;
  return total;
}

/// I(mean, shape_i, -1/K) for every arm.
Solved<std::vector<ShellMeasures>> reflectedNodes(const GeodesicCalculus& calculus, const Spider& spider,
                                                  const GeodesicOptions& options) {
  std::vector<ShellMeasures> nodes(spider.arms.size());
  std::vector<Outcome> outcomes(nodes.size());
  tbb::parallel_for(std::size_t{0}, nodes.size(), [&](std::size_t i) {
    const auto reflected = calculus.extrapolateBackwards(spider.mean, spider.arms[i][1], options);
    outcomes[i] = reflected;
    measure(calculus.topology(), reflected.solution, nodes[i]);
  });
  return {std::move(nodes), combine(outcomes)};
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
  return minimiseShell(objective, *calculus.structure(), mean, {options.max_iterations, options.tolerance, options.stop});
}

}  // namespace

Solved<ShellPga> principalVariations(const GeodesicCalculus& calculus, const Spider& spider, int modes,
                                     const GeodesicOptions& options) {
  const auto n = static_cast<int>(spider.arms.size());
  if (modes < 1 || modes > n - 1)
    throw InvalidInput("modes", std::to_string(modes) + ", want 1 to " + std::to_string(n - 1) + ", one less than the " +
                                    std::to_string(n) + " training shapes");
  const auto decomposition = spectrum(gramMatrix(calculus, spider));
  auto reflected = reflectedNodes(calculus, spider, options);
  std::vector<ShellMeasures> nodes(spider.arms.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) measure(calculus.topology(), spider.arms[i][1], nodes[i]);

  ShellPga pga;
  pga.mean = spider.mean;
  pga.eigenvalues = decomposition.values;
  pga.eigenvectors = decomposition.vectors.leftCols(modes);
  pga.path_steps = static_cast<int>(spider.arms.front().size()) - 1;
  pga.variations.resize(2 * static_cast<std::size_t>(modes));
  std::vector<Outcome> outcomes(static_cast<std::size_t>(modes));
  tbb::parallel_for(std::size_t{0}, outcomes.size(), [&](std::size_t j) {
    auto forward = variation(calculus, spider.mean, pga.eigenvectors.col(static_cast<Eigen::Index>(j)), nodes,
                             reflected.solution, options);
    auto backward = calculus.extrapolateBackwards(spider.mean, forward.solution, options);
    outcomes[j] += forward;
    outcomes[j] += backward;
    pga.variations[j] = std::move(forward.solution);
    pga.variations[outcomes.size() + j] = std::move(backward.solution);
  });
  Outcome outcome = reflected;
  outcome += combine(outcomes);
  return {std::move(pga), outcome};
}

}  // namespace shaped
