#include "core/editing/projection_accelerator.h"

#include <Eigen/QR>

namespace shaped {

void ProjectionAccelerator::add(const SubmanifoldPoint& input, const SubmanifoldPoint& output) {
  constexpr std::size_t memory = 5;
  steps_.push_back({output.alpha / output.scale,
                    submanifold_.tangentCoordinates(output) - submanifold_.tangentCoordinates(input)});
  if (steps_.size() > memory) steps_.pop_front();
}

std::optional<SubmanifoldPoint> ProjectionAccelerator::propose() const {
  constexpr double reach = 30;
  if (steps_.size() < 2) return std::nullopt;
  const auto& last = steps_.back();
  const auto count = static_cast<Eigen::Index>(steps_.size()) - 1;
  Eigen::MatrixXd step_changes(last.step.size(), count), end_changes(last.end.size(), count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto& earlier = steps_[static_cast<std::size_t>(i)];
    step_changes.col(i) = last.step - earlier.step;
    end_changes.col(i) = last.end - earlier.end;
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> least_squares;
  least_squares.setThreshold(1e-3);
  const Eigen::VectorXd weights = least_squares.compute(step_changes).solve(last.step);
  Eigen::VectorXd move = -end_changes * weights;
  const auto point = [&](double length) {
    const Eigen::VectorXd v = last.end + length * move;
    const auto half = v.size() / 2;
    // a weight below zero is one above zero on the opposite variation
    const Eigen::VectorXd below = (-v).cwiseMax(0);
    Eigen::VectorXd valid = v.cwiseMax(0);
    valid.head(half) += below.tail(half);
    valid.tail(half) += below.head(half);
    const double total = valid.sum();
    return SubmanifoldPoint{valid / total, 1 / total};
  };
  const SubmanifoldPoint end{last.end / last.end.sum(), 1 / last.end.sum()};
  const double distance =
      (submanifold_.tangentCoordinates(point(1)) - submanifold_.tangentCoordinates(end)).norm();
  if (!std::isfinite(distance)) return std::nullopt;
  return point(std::min(1.0, reach * last.step.norm() / std::max(distance, 1e-300)));
}

}  // namespace shaped
