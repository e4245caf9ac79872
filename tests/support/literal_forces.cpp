#include "tests/support/literal_forces.h"

#include "tests/support/finite_differences.h"
#include "tests/support/literal_shell_energy.h"

namespace shaped::test {
namespace {

double stepFor(const Vertices& shape) {
  return 1e-4 * (shape.colwise().maxCoeff() - shape.colwise().minCoeff()).norm();
}

}  // namespace

Vertices literalFirstForce(const Topology& topology, const Vertices& s, const Vertices& t, double eta) {
  return differenceGradient([&](const Vertices& x) { return literalShellEnergy(topology, x, t, eta); }, s, stepFor(s));
}

Vertices literalSecondForce(const Topology& topology, const Vertices& s, const Vertices& t, double eta) {
  return differenceGradient([&](const Vertices& x) { return literalShellEnergy(topology, s, x, eta); }, t, stepFor(t));
}

double relativeImbalance(const std::vector<Vertices>& forces) {
  Vertices sum = Vertices::Zero(forces.front().rows(), 3);
  double norms = 0;
  for (const auto& force : forces) sum += force, norms += force.norm();
  return sum.norm() / norms;
}

double literalPathImbalance(const Topology& topology, const std::vector<Vertices>& path, double eta) {
  double worst = 0;
  for (std::size_t k = 1; k + 1 < path.size(); ++k)
    worst = std::max(worst, relativeImbalance({literalSecondForce(topology, path[k - 1], path[k], eta),
                                               literalFirstForce(topology, path[k], path[k + 1], eta)}));
  return worst;
}

double literalPathEnergy(const Topology& topology, const std::vector<Vertices>& path, double eta) {
  double sum = 0;
  for (std::size_t k = 1; k < path.size(); ++k) sum += literalShellEnergy(topology, path[k - 1], path[k], eta);
  return sum * static_cast<double>(path.size() - 1);
}

}  // namespace shaped::test
