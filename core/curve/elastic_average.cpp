#include "core/curve/elastic_average.h"

#include <cmath>
#include <string>

#include "core/numerics/error.h"
#include "core/shell/shell_objective.h"

namespace shaped {
namespace {

void requireWeights(const std::vector<AverageTerm>& terms) {
  double sum = 0;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    if (!(terms[i].weight >= 0) || !std::isfinite(terms[i].weight))
      throw InvalidInput("weights[" + std::to_string(i) + "]", std::to_string(terms[i].weight) + ", want >= 0");
    sum += terms[i].weight;
  }
  if (!(sum > 0)) throw InvalidInput("weights", "are all zero; an average needs a positive one");
}

}  // namespace

Solved<Vertices> elasticAverage(const ShellStructurePtr& structure, const PairEnergy& energy,
                                const std::vector<AverageTerm>& terms, const Vertices& start,
                                const NewtonOptions& options, const PointPull& pull) {
  requireWeights(terms);
  ShellObjective objective(structure, energy.bending());
  for (const auto& [measures, weight] : terms) {
    if (weight == 0) continue;
    objective.addUndeformed(*measures, weight);
    if (energy.symmetry() == EnergySymmetry::kSymmetric) objective.addDeformed(*measures, weight);
  }
  if (pull.weight > 0) objective.setPull(*pull.points, pull.weight);
  return minimiseShell(objective, *structure, start, options);
}

}  // namespace shaped
