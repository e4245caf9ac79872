#include "core/curve/trajectory_filters.h"

#include <tbb/parallel_for.h>

#include <cmath>

namespace shaped {
namespace {

constexpr double kReach = 3;  ///< standard deviations, beyond which a Gaussian counts for nothing

/// The frame `offset` after frame i; none beyond the ends of an open curve.
const Vertices* frameAt(const Curve& curve, std::size_t i, std::ptrdiff_t offset) {
  const auto count = static_cast<std::ptrdiff_t>(curve.size());
  auto index = static_cast<std::ptrdiff_t>(i) + offset;
  if (curve.closed)
    index = (index % count + count) % count;
  else if (index < 0 || index >= count)
    return nullptr;
  return &curve.frames[static_cast<std::size_t>(index)];
}

Vertices filteredFrame(const Curve& curve, std::size_t i, double frames, double distance) {
  const Vertices& here = curve.frames[i];
  Vertices sum = Vertices::Zero(here.rows(), 3);
  Eigen::VectorXd total = Eigen::VectorXd::Zero(here.rows());
  const auto reach = static_cast<std::ptrdiff_t>(std::ceil(kReach * frames));
  for (std::ptrdiff_t k = -reach; k <= reach; ++k) {
    const Vertices* other = frameAt(curve, i, k);
    if (other == nullptr) continue;
    const double time = static_cast<double>(k) / frames;
    const Eigen::ArrayXd squares = (*other - here).rowwise().squaredNorm();
    const Eigen::VectorXd weight = (-0.5 * time * time - 0.5 / (distance * distance) * squares).exp();
    sum += weight.asDiagonal() * *other;
    total += weight;
  }
  return total.cwiseInverse().asDiagonal() * sum;
}

}  // namespace

Curve averagedLinearly(const Curve& curve, int steps, double tau) {
  Curve now = curve;
  for (int step = 0; step < steps; ++step) {
    const Curve before = now;
    tbb::parallel_for(std::size_t{0}, curve.size(), [&](std::size_t i) {
      if (!curve.closed && (i == 0 || i + 1 == curve.size())) return;
      now.frames[i] = (1 - tau) * before.frames[i] +
                      0.5 * tau * (before.frames[before.previous(i)] + before.frames[before.next(i)]);
    });
  }
  return now;
}

Curve filteredBilaterally(const Curve& curve, double frames, double distance) {
  Curve result = curve;
  tbb::parallel_for(std::size_t{0}, curve.size(),
                    [&](std::size_t i) { result.frames[i] = filteredFrame(curve, i, frames, distance); });
  return result;
}

}  // namespace shaped
