#include "core/mesh/collapse_probe.h"

namespace shaped {
namespace {

constexpr double kSmallestTurnCosine = 0.34;  ///< of 70 degrees
constexpr double kSoundQuality = 0.2;
constexpr double kSoundFold = 0.5;  ///< 1 + cosine of 120 degrees
constexpr double kPoorRegularity = 0.5;
constexpr double kClearGain = 1.2;
constexpr double kTiny = 1e-300;  ///< keeps a quotient of zeros finite

auto regularity(const ShapeGroup::Values& quality, const ShapeGroup::Values& fold) {
  return (quality / kSoundQuality).min((1 + fold) / kSoundFold);
}

void setDifference(auto& result, const ShapeGroup& shapes, std::int32_t tip, std::int32_t origin) {
  result.x = shapes.coordinate(tip, 0) - shapes.coordinate(origin, 0);
  result.y = shapes.coordinate(tip, 1) - shapes.coordinate(origin, 1);
  result.z = shapes.coordinate(tip, 2) - shapes.coordinate(origin, 2);
}

void lowerTo(ShapeGroup::Values& smallest, const auto& values) { smallest = smallest.min(values); }

}  // namespace

CollapseProbe::Verdict CollapseProbe::judge(const ShapeGroup& shapes, const CollapseStar& star, double floor) {
  measureTriangles(shapes, star);
  measureFolds(star);
  const auto before = regularity(quality_before_, fold_before_), after = regularity(quality_after_, fold_after_);
  const auto unfolds = before < kPoorRegularity && after > kClearGain * before;
  const bool acceptable = !(turn_ < kSmallestTurnCosine && !unfolds).any() && !(after < before.min(floor)).any();
  return {acceptable, before.minCoeff(), after.minCoeff()};
}

/// Also leaves the triangle's squared quality in squared_quality_.
void CollapseProbe::setNormal(Vectors& normal, const ShapeGroup& shapes, std::int32_t apex, std::int32_t b,
                              std::int32_t c) {
  setDifference(base_, shapes, c, b);
  setDifference(side_, shapes, apex, b);
  normal.x = base_.y * side_.z - base_.z * side_.y;
  normal.y = base_.z * side_.x - base_.x * side_.z;
  normal.z = base_.x * side_.y - base_.y * side_.x;
  // |apex - c|^2 = |side|^2 + |base|^2 - 2 side.base completes the sum of squared edge lengths
  length_ = 2 * (side_.dot(side_) + base_.dot(base_) - side_.dot(base_));
  squared_quality_ = 12 * normal.dot(normal) / (length_ * length_ + kTiny);
  length_ = (normal.dot(normal) + kTiny).sqrt();
  normal.x /= length_;
  normal.y /= length_;
  normal.z /= length_;
}

void CollapseProbe::measureTriangles(const ShapeGroup& shapes, const CollapseStar& star) {
  const auto count = star.outer_edges.size();
  if (before_.size() < count) before_.resize(count), after_.resize(count), beyond_.resize(count);
  survives_.assign(count, 0);
  for (auto* values : {&turn_, &quality_before_, &quality_after_}) values->setOnes(shapes.size());
  for (std::size_t t = 0; t < count; ++t) {
    const auto [b, c] = star.outer_edges[t];
    setNormal(before_[t], shapes, star.from, b, c);
    lowerTo(quality_before_, squared_quality_);
    if (star.tips[t] >= 0) setNormal(beyond_[t], shapes, star.tips[t], c, b);
    if (b == star.to || c == star.to) continue;
    survives_[t] = 1;
    setNormal(after_[t], shapes, star.to, b, c);
    lowerTo(quality_after_, squared_quality_);
    lowerTo(turn_, before_[t].dot(after_[t]));
  }
  quality_before_ = quality_before_.sqrt();
  quality_after_ = quality_after_.sqrt();
}

void CollapseProbe::measureFolds(const CollapseStar& star) {
  const auto count = star.outer_edges.size();
  fold_before_.setOnes(turn_.size());
  fold_after_.setOnes(turn_.size());
  for (std::size_t t = 0; t < count; ++t) {
    const bool outer = star.tips[t] >= 0, linked = star.closed || t + 1 < count;
    const std::size_t next = t + 1 < count ? t + 1 : 0;
    if (outer) lowerTo(fold_before_, before_[t].dot(beyond_[t]));
    if (linked) lowerTo(fold_before_, before_[t].dot(before_[next]));
    if (outer && survives_[t]) lowerTo(fold_after_, after_[t].dot(beyond_[t]));
    if (!linked) continue;
    if (survives_[t] && survives_[next]) lowerTo(fold_after_, after_[t].dot(after_[next]));
    // A triangle that vanishes hands its outer neighbour to the survivor beside it.
    if (survives_[t] && !survives_[next] && star.tips[next] >= 0) lowerTo(fold_after_, after_[t].dot(beyond_[next]));
    if (!survives_[t] && survives_[next] && outer) lowerTo(fold_after_, after_[next].dot(beyond_[t]));
  }
}

}  // namespace shaped
