#pragma once

#include <deque>
#include <optional>

#include "core/statistics/submanifold.h"

namespace shaped {

/// Anderson acceleration of a fixed-point iteration on the submanifold: alternating between a shape and its projection
/// converges linearly and slowly; the last few steps tell where it goes.
///
/// Points are combined as v = alpha / scale, in which the submanifold is linear to first order and which a point is
/// recovered from; the combination is the one whose step, in tangent coordinates, is shortest.
class ProjectionAccelerator {
 public:
  explicit ProjectionAccelerator(const Submanifold& submanifold) : submanifold_(submanifold) {}

  /// Where a round starts or ends.
  struct State {
    SubmanifoldPoint point;
    double extra = 0;  ///< a further unknown of the iteration, scaled to [m]
  };

  /// Remembers that a round which started at `input` ended at `output`.
  void add(const State& input, const State& output);

  /// Where the iteration seems to go; empty while there are not two steps to tell. The proposal lies at most thirty
  /// times the last step away.
  std::optional<State> propose() const;

  /// Drops what was remembered.
  void forget() { steps_.clear(); }

 private:
  struct Step {
    Eigen::VectorXd end;   ///< v of the output, then its extra unknown
    Eigen::VectorXd step;  ///< tangent coordinates and extra unknown of the output less those of the input [m]
  };

  Eigen::VectorXd coordinates(const State& state) const;
  State stateAt(const Eigen::VectorXd& end) const;

  const Submanifold& submanifold_;
  std::deque<Step> steps_;
};

}  // namespace shaped
