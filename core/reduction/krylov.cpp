#include "core/reduction/krylov.h"

#include <tbb/parallel_invoke.h>

#include <optional>

#include "core/shell/energy.h"

namespace shaped {
namespace {

using Vector = Eigen::VectorXd;

Eigen::Map<const Vector> flat(const Vertices& shape) { return {shape.data(), shape.size()}; }

/// Linear elasticity about one shape.
class RestingShape {
 public:
  RestingShape(const ShellStructurePtr& structure, double bending, const Vertices& shape, const std::stop_token& stop)
      : topology_(structure->topology()),
        bending_(bending),
        shape_(shape),
        measures_(measure(topology_, shape)),
        rigid_(infinitesimalRigidMotions(shape)),
        masses_(Vector::Zero(shape.size())),
        pins_(gaugePins(shape)),
        factor_(structure->analysis()) {
    for (Eigen::Index f = 0; f < topology_.faces().rows(); ++f)
      for (int c = 0; c < 3; ++c) masses_.segment<3>(3 * topology_.faces()(f, c)).array() += measures_.area[f] / 3;
    MeasureCurvature curvature(topology_, HessianKind::kExact);
    addSecondCurvature(topology_, measures_, measures_, bending, 1, curvature);
    SymmetricBlockMatrix hessian(structure->pattern());
    pullBackHessian(*structure, shape, curvature, hessian);
    usable_ = factor_.factorise(hessian, pins_, stop);
  }

  bool usable() const { return usable_; }
  const ShellMeasures& measures() const { return measures_; }

  /// The linearised deformation towards another shape.
  Vector towards(const ShellMeasures& other) const {
    MeasureGradient gradient(topology_);
    addSecondGradient(topology_, other, measures_, bending_, 1, gradient);
    Vertices force = Vertices::Zero(shape_.rows(), 3);
    pullBackGradient(topology_, shape_, gradient, force);
    return solve(-flat(force));
  }
  Vector smoother(const Vector& direction) const { return solve(masses_.cwiseProduct(direction)); }

 private:
  /// H^-1 of a load without its rigid part, which H cannot carry; without a rigid part itself.
  Vector solve(Vector load) const {
    load -= rigid_ * (rigid_.transpose() * load);
    pins_.clear(load.data());
    Vector result(load.size());
    factor_.solve(load.data(), result.data());
    return result - rigid_ * (rigid_.transpose() * result);
  }

  const Topology& topology_;
  double bending_;
  const Vertices& shape_;
  ShellMeasures measures_;
  Eigen::MatrixXd rigid_;
  Vector masses_;
  Pins pins_;
  CholeskyFactor factor_;
  bool usable_ = false;
};

}  // namespace

Solved<ShapeSubspace> krylovSubspace(const ShellStructurePtr& structure, double bending, const Vertices& a,
                                     const Vertices& b, int dimension, const std::stop_token& stop) {
  ShapeSubspace result{a, Eigen::MatrixXd(a.size(), 0)};
  const auto ended = [&](Termination termination) {
    return Solved<ShapeSubspace>(std::move(result), {termination, 0, 0});
  };
  if (!result.append(flat(b) - flat(a))) return ended(Termination::kConverged);  // the shapes are equal
  std::optional<RestingShape> at_a, at_b;
  tbb::parallel_invoke([&] { at_a.emplace(structure, bending, a, stop); },
                       [&] { at_b.emplace(structure, bending, b, stop); });
  if (stop.stop_requested()) return ended(Termination::kCancelled);
  if (!at_a->usable() || !at_b->usable()) return ended(Termination::kNumericalFailure);
  // Each sequence goes on from what was new in its last vector: the powers themselves would soon all look the same.
  Vector from_a = at_a->towards(at_b->measures()), from_b = at_b->towards(at_a->measures());
  while (result.dimension() < dimension && (from_a.size() > 0 || from_b.size() > 0)) {
    if (stop.stop_requested()) return ended(Termination::kCancelled);
    for (auto [shape, next] : {std::pair{&*at_a, &from_a}, std::pair{&*at_b, &from_b}}) {
      if (next->size() == 0 || result.dimension() == dimension) continue;
      const bool more = result.append(*next);
      *next = more ? shape->smoother(result.basis.rightCols<1>()) : Vector();
    }
  }
  return ended(Termination::kConverged);
}

}  // namespace shaped
