#include "core/editing/projection_accelerator.h"

#include <Eigen/QR>

namespace shaped {

Eigen::VectorXd ProjectionAccelerator::coordinates(const State& state) const {
  Eigen::VectorXd result = submanifold_.tangentCoordinates(state.point);
  result.conservativeResize(result.size() + 1);
  result[result.size() - 1] = state.extra;
  return result;
}

ProjectionAccelerator::State ProjectionAccelerator::stateAt(const Eigen::VectorXd& end) const {
  const auto half = (end.size() - 1) / 2;
  const Eigen::VectorXd v = end.head(2 * half);
  // a weight below zero is one above zero on the opposite variation
  const Eigen::VectorXd below = (-v).cwiseMax(0);
  Eigen::VectorXd valid = v.cwiseMax(0);
  valid.head(half) += below.tail(half);
  valid.tail(half) += below.head(half);
  const double total = valid.sum();
  return {{valid / total, 1 / total}, end[2 * half]};
}

void ProjectionAccelerator::add(const State& input, const State& output) {
  constexpr std::size_t memory = 5;
  Eigen::VectorXd end = output.point.alpha / output.point.scale;
  end.conservativeResize(end.size() + 1);
  end[end.size() - 1] = output.extra;
  steps_.push_back({std::move(end), coordinates(output) - coordinates(input)});
  if (steps_.size() > memory) steps_.pop_front();
}

std::optional<ProjectionAccelerator::State> ProjectionAccelerator::propose() const {
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
  const Eigen::VectorXd move = -end_changes * weights;
  const double distance = (coordinates(stateAt(last.end + move)) - coordinates(stateAt(last.end))).norm();
  if (!std::isfinite(distance)) return std::nullopt;
  return stateAt(last.end + std::min(1.0, reach * last.step.norm() / std::max(distance, 1e-300)) * move);
}

}  // namespace shaped
