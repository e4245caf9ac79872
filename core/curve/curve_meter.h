#pragma once

#include <vector>

#include "core/curve/curve.h"

namespace shaped {

/// Measures an open curve whose frames come one by one and are not kept: the same numbers as segmentEnergies() and
/// gradientNorms().
class CurveMeter {
 public:
  CurveMeter(TopologyPtr topology, double bending)
      : topology_(std::move(topology)), energy_(bending, EnergySymmetry::kSymmetric) {}

  void add(const Vertices& frame);

  double pathEnergy() const { return path_energy_; }  ///< (4) of the frames so far [m^2]
  /// One for each frame so far; that of the last one is 0 until the next comes.
  const std::vector<double>& gradientNorms() const { return gradient_norms_; }

 private:
  TopologyPtr topology_;
  PairEnergy energy_;
  Vertices last_;
  ShellMeasures before_last_measures_, last_measures_;
  double path_energy_ = 0;
  std::vector<double> gradient_norms_;
};

}  // namespace shaped
