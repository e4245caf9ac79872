#include "core/curve/curve.h"

#include <tbb/parallel_for.h>

#include "core/numerics/error.h"
#include "core/shell/measure_derivatives.h"

namespace shaped {

void requireCurve(const Topology& topology, const Curve& curve, const std::string& field) {
  const std::size_t least = curve.closed ? 3 : 2;
  if (curve.size() < least)
    throw InvalidInput(field, "has " + std::to_string(curve.size()) + " frames, " +
                                  (curve.closed ? "a closed" : "an open") + " curve needs at least " +
                                  std::to_string(least));
  for (std::size_t i = 0; i < curve.size(); ++i)
    requireValidShape(topology, curve.frames[i], field + "[" + std::to_string(i) + "]");
}

std::vector<ShellMeasures> measuresOf(const Topology& topology, const Curve& curve) {
  std::vector<ShellMeasures> measures(curve.size());
  tbb::parallel_for(std::size_t{0}, curve.size(),
                    [&](std::size_t i) { measure(topology, curve.frames[i], measures[i]); });
  return measures;
}

std::vector<double> segmentEnergies(const Topology& topology, double bending, const Curve& curve,
                                    const std::vector<ShellMeasures>& measures) {
  const PairEnergy energy(bending, EnergySymmetry::kSymmetric);
  std::vector<double> energies(curve.segments());
  tbb::parallel_for(std::size_t{0}, energies.size(), [&](std::size_t i) {
    energies[i] = kBothDirections * energy.value(topology, measures[i], measures[curve.next(i)]);
  });
  return energies;
}

Vertices curveGradient(const Topology& topology, const PairEnergy& energy, const Vertices& shape,
                       const ShellMeasures& before, const ShellMeasures& here, const ShellMeasures& after) {
  MeasureGradient gradient(topology);
  energy.addSecondGradient(topology, before, here, kBothDirections, gradient);
  energy.addFirstGradient(topology, here, after, kBothDirections, gradient);
  Vertices force = Vertices::Zero(shape.rows(), 3);
  pullBackGradient(topology, shape, gradient, force);
  return force;
}

std::vector<double> gradientNorms(const Topology& topology, double bending, const Curve& curve,
                                  const std::vector<ShellMeasures>& measures) {
  const PairEnergy energy(bending, EnergySymmetry::kSymmetric);
  std::vector<double> norms(curve.size(), 0);
  tbb::parallel_for(std::size_t{0}, curve.size(), [&](std::size_t i) {
    if (!curve.closed && (i == 0 || i + 1 == curve.size())) return;
    norms[i] = curveGradient(topology, energy, curve.frames[i], measures[curve.previous(i)], measures[i],
                             measures[curve.next(i)])
                   .norm();
  });
  return norms;
}

}  // namespace shaped
