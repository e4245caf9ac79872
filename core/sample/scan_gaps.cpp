#include "core/sample/scan_gaps.h"

#include <algorithm>

#include "core/sample/random_direction.h"

namespace shaped {
namespace {

/// Values of the points that are left, with their numbers, ascending.
std::vector<std::pair<double, Eigen::Index>> ordered(const Eigen::VectorXd& values, const std::vector<bool>& left) {
  std::vector<std::pair<double, Eigen::Index>> list;
  for (Eigen::Index i = 0; i < values.size(); ++i)
    if (left[std::size_t(i)]) list.emplace_back(values[i], i);
  std::sort(list.begin(), list.end());
  return list;
}

/// A value between the first `count` and the others.
double between(const std::vector<std::pair<double, Eigen::Index>>& list, std::size_t count) {
  return 0.5 * (list[count - 1].first + list[count].first);
}

}  // namespace

std::optional<ScanCut> cutAway(const Vertices& points, Eigen::Index count, Random& random, std::vector<bool>& left) {
  if (count == 0) return std::nullopt;
  const Eigen::RowVector3d normal = randomDirection(random).transpose();
  const auto list = ordered(-(points * normal.transpose()), left);
  for (Eigen::Index i = 0; i < count; ++i) left[std::size_t(list[std::size_t(i)].second)] = false;
  return ScanCut{normal, -between(list, std::size_t(count))};
}

std::vector<ScanHole> punchHoles(const Vertices& points, Eigen::Index count, double radius, Random& random,
                                 std::vector<bool>& left) {
  std::vector<ScanHole> holes;
  while (count > 0) {
    auto centre = Eigen::Index(random.uniform() * double(points.rows()));
    if (!left[std::size_t(centre)]) continue;
    ScanHole hole{points.row(centre), radius * random.uniform(0.5, 1.5)};
    const auto list = ordered((points.rowwise() - hole.centre).rowwise().norm(), left);
    std::size_t taken = 0;
    while (taken < list.size() && list[taken].first < hole.radius) ++taken;
    if (taken > std::size_t(count)) {
      taken = std::size_t(count);
      hole.radius = between(list, taken);
    }
    for (std::size_t i = 0; i < taken; ++i) left[std::size_t(list[i].second)] = false;
    count -= Eigen::Index(taken);
    holes.push_back(hole);
  }
  return holes;
}

}  // namespace shaped
