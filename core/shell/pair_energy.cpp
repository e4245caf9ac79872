#include "core/shell/pair_energy.h"

namespace shaped {

double PairEnergy::value(const Topology& topology, const ShellMeasures& a, const ShellMeasures& b) const {
  const double forth = shellEnergy(topology, a, b, bending_);
  return symmetric() ? 0.5 * (forth + shellEnergy(topology, b, a, bending_)) : forth;
}

void PairEnergy::addFirstGradient(const Topology& topology, const ShellMeasures& a, const ShellMeasures& b,
                                  double weight, MeasureGradient& gradient) const {
  shaped::addFirstGradient(topology, a, b, bending_, share(weight), gradient);
  if (symmetric()) shaped::addSecondGradient(topology, b, a, bending_, share(weight), gradient);
}

void PairEnergy::addSecondGradient(const Topology& topology, const ShellMeasures& a, const ShellMeasures& b,
                                   double weight, MeasureGradient& gradient) const {
  shaped::addSecondGradient(topology, a, b, bending_, share(weight), gradient);
  if (symmetric()) shaped::addFirstGradient(topology, b, a, bending_, share(weight), gradient);
}

void PairEnergy::addFirstCurvature(const Topology& topology, const ShellMeasures& a, const ShellMeasures& b,
                                   double weight, MeasureCurvature& curvature) const {
  shaped::addFirstCurvature(topology, a, b, bending_, share(weight), curvature);
  if (symmetric()) shaped::addSecondCurvature(topology, b, a, bending_, share(weight), curvature);
}

void PairEnergy::addSecondCurvature(const Topology& topology, const ShellMeasures& a, const ShellMeasures& b,
                                    double weight, MeasureCurvature& curvature) const {
  shaped::addSecondCurvature(topology, a, b, bending_, share(weight), curvature);
  if (symmetric()) shaped::addFirstCurvature(topology, b, a, bending_, share(weight), curvature);
}

void PairEnergy::addMixedHessian(const ShellStructure& structure, const Vertices& a, const ShellMeasures& a_measures,
                                 const Vertices& b, const ShellMeasures& b_measures, double weight,
                                 GeneralBlockMatrix& matrix) const {
  shaped::addMixedHessian(structure, a, a_measures, b, b_measures, bending_, share(weight), matrix);
  if (!symmetric()) return;
  GeneralBlockMatrix back(structure.pattern());
  shaped::addMixedHessian(structure, b, b_measures, a, a_measures, bending_, share(weight), back);
  matrix.addTransposed(back);
}

}  // namespace shaped
