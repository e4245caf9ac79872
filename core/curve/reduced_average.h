#pragma once

#include "core/curve/elastic_average.h"
#include "core/reduction/ghost_space.h"
#include "core/shell/average_energy.h"

namespace shaped {

/// Where one frame may be: in a subspace that all frames share, and along a direction of its own.
struct FrameSpace {
  const GhostSpace* shared;
  Eigen::VectorXd own = {};  ///< on the ghost mesh, 3G; empty: none

  Eigen::Index dimension() const { return shared->dimension() + (own.size() > 0 ? 1 : 0); }
  /// The ghost of these coordinates, the own direction's last. G x 3.
  Vertices ghost(const Eigen::VectorXd& coordinates) const;
};

/// Draws a frame back: adds weight * |coordinates - target|^2 to what is minimised [m^2]. With orthonormal directions
/// that is the squared distance of the vertices.
struct CoordinatePull {
  Eigen::VectorXd target = {};
  double weight = 0;
};

/// The sum that an elastic average minimises, as a function of a frame's coordinates.
class ReducedAverage {
 public:
  /// terms: measures of ghosts. space: lives as long as this.
  ReducedAverage(const FrameSpace& space, const PairEnergy& energy, const std::vector<AverageTerm>& terms,
                 CoordinatePull pull = {});

  /// The value and its gradient in the coordinates.
  double operator()(const Eigen::VectorXd& coordinates, Eigen::VectorXd& gradient);
  double noise() const { return noise_; }
  /// The Hessian in the coordinates, with every element made positive semi-definite, d x d.
  Eigen::MatrixXd hessian(const Eigen::VectorXd& coordinates);

 private:
  void moveTo(const Eigen::VectorXd& coordinates);
  /// Of a vector on the ghost mesh along the frame's directions.
  void project(const Eigen::Ref<const Eigen::VectorXd>& vector, Eigen::VectorXd& coordinates) const;

  const FrameSpace& space_;
  const Topology& topology_;
  double bending_;
  AverageEnergy undeformed_;
  std::vector<AverageTerm> deformed_;
  CoordinatePull pull_;
  double noise_ = 0;
  Vertices shape_, force_;
  ShellMeasures measures_;
  MeasureGradient gradient_;
};

}  // namespace shaped
