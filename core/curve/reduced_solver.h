#pragma once

#include "core/curve/reduced_average.h"
#include "core/curve/smoothing_flow.h"

namespace shaped {

/// How an average within a space is found.
enum class AverageMethod {
  kBfgs,    ///< from an inverse Hessian that is computed at the first average and kept up to date: many cheap steps
  kNewton,  ///< a Hessian for each step: one or two, each ten times as long on a ghost mesh of 1250 vertices
};

/// Averages of one frame within its space, one after the other. For one thread at a time.
class ReducedSolver {
 public:
  /// tolerance: of sqrt(gain that is left / energy of the terms at the start), > 0.
  ReducedSolver(FrameSpace space, const PairEnergy& energy, double tolerance, std::stop_token stop,
                AverageMethod method = AverageMethod::kBfgs)
      : space_(std::move(space)), energy_(energy), tolerance_(tolerance), stop_(std::move(stop)), method_(method) {}

  const FrameSpace& space() const { return space_; }
  /// The coordinates of the average. No iterations: the start had nothing to gain.
  Solved<Eigen::VectorXd> average(const std::vector<AverageTerm>& terms, const Eigen::VectorXd& start,
                                  CoordinatePull pull = {});

 private:
  FrameSpace space_;
  PairEnergy energy_;
  double tolerance_;
  std::stop_token stop_;
  AverageMethod method_;
  Eigen::MatrixXd inverse_;
};

}  // namespace shaped
