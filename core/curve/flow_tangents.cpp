#include "core/curve/flow_tangents.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "core/reduction/subspace.h"
#include "core/shell/shell_objective.h"

namespace shaped {
namespace {

struct Tangent {
  Eigen::VectorXd direction;
  double imbalance = 0;
};

Tangent tangentOf(const ShellStructure& structure, const PairEnergy& energy, const Vertices& shape,
                  const ShellMeasures& before, const ShellMeasures& here, const ShellMeasures& after,
                  const std::stop_token& stop) {
  const auto& topology = structure.topology();
  const auto force = [&](const auto& add) {
    MeasureGradient gradient(topology);
    add(gradient);
    Vertices pulled = Vertices::Zero(shape.rows(), 3);
    pullBackGradient(topology, shape, gradient, pulled);
    return flatten(pulled);
  };
  const Eigen::VectorXd backward =
      force([&](MeasureGradient& gradient) { energy.addSecondGradient(topology, before, here, 1, gradient); });
  const Eigen::VectorXd forward =
      force([&](MeasureGradient& gradient) { energy.addFirstGradient(topology, here, after, 1, gradient); });
  const double floor = forceFloor(topology, shape, here, energy.bending());
  Tangent result{{}, (backward + forward).norm() / (backward.norm() + forward.norm() + floor)};

  MeasureCurvature curvature(topology, HessianKind::kProjected);
  energy.addSecondCurvature(topology, before, here, 1, curvature);
  energy.addFirstCurvature(topology, here, after, 1, curvature);
  SymmetricBlockMatrix hessian(structure.pattern());
  pullBackHessian(structure, shape, curvature, hessian);
  const Pins pins = gaugePins(shape);
  CholeskyFactor factor(structure.analysis());
  if (!factor.factorise(hessian, pins, stop)) return result;
  Eigen::VectorXd right = -(backward + forward);
  pins.clear(right.data());
  result.direction.resize(right.size());
  factor.solve(right.data(), result.direction.data(), 1, stop);
  const auto rigid = infinitesimalRigidMotions(shape);
  result.direction -= rigid * (rigid.transpose() * result.direction);
  return result;
}

/// The solution of y_i - (y_i-1 + y_i+1) / 2 = directions_i between fixed ends (Thomas' algorithm).
std::vector<Eigen::VectorXd> spread(const std::vector<Eigen::VectorXd>& directions) {
  const std::size_t last = directions.size() - 2;
  std::vector<double> factor(directions.size(), 0);
  auto result = directions;
  for (std::size_t i = 1; i <= last; ++i) {
    if (result[i].size() == 0) return {};
    const double pivot = 1 - 0.5 * factor[i - 1];
    factor[i] = 0.5 / pivot;
    if (i > 1) result[i] += 0.5 * result[i - 1];
    result[i] /= pivot;
  }
  for (std::size_t i = last; i > 1; --i) result[i - 1] += factor[i - 1] * result[i];
  return result;
}

}  // namespace

FlowTangents flowTangents(const ShellStructurePtr& structure, double bending, const Curve& curve,
                          const std::stop_token& stop) {
  const PairEnergy energy(bending, EnergySymmetry::kSymmetric);
  const auto measures = measuresOf(structure->topology(), curve);
  FlowTangents result;
  result.directions.resize(curve.size());
  std::vector<double> imbalances(curve.size(), 0);
  tbb::parallel_for(std::size_t{0}, curve.size(), [&](std::size_t i) {
    if (stop.stop_requested() || (!curve.closed && (i == 0 || i + 1 == curve.size()))) return;
    auto tangent = tangentOf(*structure, energy, curve.frames[i], measures[curve.previous(i)], measures[i],
                             measures[curve.next(i)], stop);
    result.directions[i] = std::move(tangent.direction);
    imbalances[i] = tangent.imbalance;
  });
  if (curve.size() > 2 && !curve.closed) result.displacements = spread(result.directions);
  result.residual = *std::max_element(imbalances.begin(), imbalances.end());
  return result;
}

}  // namespace shaped
