#include "core/curve/flow_tangents.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <utility>

#include "core/reduction/subspace.h"
#include "core/shell/shell_objective.h"

namespace shaped {
namespace {

struct Tangent {
  Eigen::VectorXd direction;
  double imbalance = 0;
};

/// For one thread at a time. The Hessian and its factor are large: each thread keeps its own.
class TangentSolver {
 public:
  TangentSolver(const ShellStructure& structure, const PairEnergy& energy, const std::stop_token& stop)
      : structure_(structure),
        energy_(energy),
        stop_(stop),
        hessian_(structure.pattern()),
        factor_(structure.analysis()) {}

  /// Of a frame between two others.
  Tangent operator()(const Vertices& shape, const ShellMeasures& before, const ShellMeasures& here,
                     const ShellMeasures& after) {
    const auto& topology = structure_.topology();
    const auto force = [&](const auto& add) {
      MeasureGradient gradient(topology);
      add(gradient);
      Vertices pulled = Vertices::Zero(shape.rows(), 3);
      pullBackGradient(topology, shape, gradient, pulled);
      return flatten(pulled);
    };
    const Eigen::VectorXd backward =
        force([&](MeasureGradient& gradient) { energy_.addSecondGradient(topology, before, here, 1, gradient); });
    const Eigen::VectorXd forward =
        force([&](MeasureGradient& gradient) { energy_.addFirstGradient(topology, here, after, 1, gradient); });
    const double floor = forceFloor(topology, shape, here, energy_.bending());
    Tangent result{{}, (backward + forward).norm() / (backward.norm() + forward.norm() + floor)};
    const Pins pins = gaugePins(shape);
    const auto factorise = [&](HessianKind kind) {
      MeasureCurvature curvature(topology, kind);
      energy_.addSecondCurvature(topology, before, here, 1, curvature);
      energy_.addFirstCurvature(topology, here, after, 1, curvature);
      hessian_.setZero();
      pullBackHessian(structure_, shape, curvature, hessian_);
      return factor_.factorise(hessian_, pins, stop_);
    };
    // Near a geodesic the Hessian itself is positive definite, and its step the better one.
    const bool usable =
        factorise(HessianKind::kExact) || (!stop_.stop_requested() && factorise(HessianKind::kProjected));
    if (!usable) return result;
    Eigen::VectorXd right = -(backward + forward);
    pins.clear(right.data());
    result.direction.resize(right.size());
    factor_.solve(right.data(), result.direction.data(), 1, stop_);
    const auto rigid = infinitesimalRigidMotions(shape);
    result.direction -= rigid * (rigid.transpose() * result.direction);
    return result;
  }

 private:
  const ShellStructure& structure_;
  const PairEnergy& energy_;
  const std::stop_token& stop_;
  SymmetricBlockMatrix hessian_;
  CholeskyFactor factor_;
};

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

std::vector<FlowTangents> flowTangents(const ShellStructurePtr& structure, double bending,
                                       const std::vector<Curve>& curves, const std::stop_token& stop) {
  const PairEnergy energy(bending, EnergySymmetry::kSymmetric);
  std::vector<FlowTangents> results(curves.size());
  std::vector<std::vector<ShellMeasures>> measures;
  std::vector<std::pair<std::size_t, std::size_t>> wanted;  // curve, frame
  for (std::size_t c = 0; c < curves.size(); ++c) {
    const std::size_t size = curves[c].size(), end = curves[c].closed ? 0 : 1;
    measures.push_back(measuresOf(structure->topology(), curves[c]));
    results[c].directions.resize(size);
    for (std::size_t i = end; i + end < size; ++i) wanted.emplace_back(c, i);
  }
  std::vector<double> imbalances(wanted.size(), 0);
  tbb::enumerable_thread_specific<TangentSolver> solvers([&] { return TangentSolver(*structure, energy, stop); });
  tbb::parallel_for(std::size_t{0}, wanted.size(), [&](std::size_t k) {
    if (stop.stop_requested()) return;
    const auto [c, i] = wanted[k];
    const auto& curve = curves[c];
    auto tangent =
        solvers.local()(curve.frames[i], measures[c][curve.previous(i)], measures[c][i], measures[c][curve.next(i)]);
    results[c].directions[i] = std::move(tangent.direction);
    imbalances[k] = tangent.imbalance;
  });
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    auto& residual = results[wanted[k].first].residual;
    residual = std::max(residual, imbalances[k]);
  }
  for (std::size_t c = 0; c < curves.size(); ++c)
    if (curves[c].size() > 2 && !curves[c].closed) results[c].displacements = spread(results[c].directions);
  return results;
}

}  // namespace shaped
