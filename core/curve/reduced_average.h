#pragma once

#include "core/curve/elastic_average.h"
#include "core/shell/average_energy.h"

namespace shaped {

/// The sum that an elastic average minimises, as a function of coordinates in a subspace: shape = origin + basis q.
class ReducedAverage {
 public:
  /// origin, basis: G x 3 and 3G x d; they live as long as this.
  ReducedAverage(const ShellStructure& structure, const PairEnergy& energy, const std::vector<AverageTerm>& terms,
                 const Vertices& origin, const Eigen::MatrixXd& basis);

  /// The value and its gradient in q.
  double operator()(const Eigen::VectorXd& q, Eigen::VectorXd& gradient);
  double noise() const { return noise_; }
  /// The Hessian in q, with every element made positive semi-definite, d x d.
  Eigen::MatrixXd hessian(const Eigen::VectorXd& q);

 private:
  void moveTo(const Eigen::VectorXd& q);

  const ShellStructure& structure_;
  const Topology& topology_;
  const Vertices& origin_;
  const Eigen::MatrixXd& basis_;
  double bending_;
  AverageEnergy undeformed_;
  std::vector<AverageTerm> deformed_;
  double noise_ = 0;
  Vertices shape_, force_;
  ShellMeasures measures_;
  MeasureGradient gradient_;
};

}  // namespace shaped
