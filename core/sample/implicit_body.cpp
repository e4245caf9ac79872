#include "core/sample/implicit_body.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace shaped {
namespace {

constexpr double kJointBlend = 0.025, kLimbBlend = 0.016;  // m

/// Where the sphere that touches the surface nearest to a point sits on the bone: its parameter and radius.
struct Touch {
  double along, radius;
};

Touch touchingSphere(const Bone& bone, const Eigen::Vector3d& point) {
  const Eigen::Vector3d axis = bone.end - bone.joint, offset = point - bone.joint;
  const double length = axis.norm(), taper = std::clamp((bone.joint_radius - bone.end_radius) / length, -0.99, 0.99);
  const double along = offset.dot(axis) / length;
  const double away = std::sqrt(std::max(0.0, offset.squaredNorm() - along * along));
  // The cone's normal leans towards the thin end, so the touching sphere lies nearer to the thick one.
  const double leaned = along - away * taper / std::sqrt(1 - taper * taper);
  const double t = std::clamp(leaned / length, 0.0, 1.0);
  return {t, (1 - t) * bone.joint_radius + t * bone.end_radius};
}

/// The smaller of two distances, rounded where they differ by less than `width` (a quadratic blend).
Level smoothMin(const Level& a, const Level& b, double width) {
  const Level &low = a.value < b.value ? a : b, &high = a.value < b.value ? b : a;
  const double overlap = std::max(width - (high.value - low.value), 0.0) / width;
  const double share = 0.5 * overlap;  // of the farther one: half where both are equal
  return {low.value - 0.25 * width * overlap * overlap, (1 - share) * low.gradient + share * high.gradient};
}

Level boneLevel(const Bone& bone, const Eigen::Vector3d& point) {
  const Touch touch = touchingSphere(bone, point);
  const Eigen::Vector3d offset = point - bone.joint - touch.along * (bone.end - bone.joint);
  const double distance = offset.norm();
  return {distance - touch.radius, distance > 0 ? Eigen::Vector3d(offset / distance) : Eigen::Vector3d::Zero()};
}

}  // namespace

double distanceToBone(const Bone& bone, const Eigen::Vector3d& point) { return boneLevel(bone, point).value; }

Level ImplicitBody::level(const Eigen::Vector3d& point) const {
  std::array<Level, kLimbCount> limbs;
  limbs.fill({std::numeric_limits<double>::infinity(), Eigen::Vector3d::Zero()});
  for (const auto& bone : bones_) {
    Level& limb = limbs[static_cast<std::size_t>(bone.limb)];
    const Level own = boneLevel(bone, point);
    limb = std::isinf(limb.value) ? own : smoothMin(limb, own, kJointBlend);
  }
  // Limbs blend through a sum of exponentials, which does not depend on their order: left and right stay alike.
  double nearest = std::numeric_limits<double>::infinity(), sum = 0;
  for (const auto& limb : limbs) nearest = std::min(nearest, limb.value);
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  for (const auto& limb : limbs) {
    const double weight = std::exp((nearest - limb.value) / kLimbBlend);
    sum += weight;
    gradient += weight * limb.gradient;
  }
  return {nearest - kLimbBlend * std::log(sum), gradient / sum};
}

Eigen::Vector3d ImplicitBody::project(const Eigen::Vector3d& point) const {
  Eigen::Vector3d position = point;
  for (int step = 0; step < 4; ++step) {
    const auto [value, slope] = level(position);
    position -= value / std::max(slope.squaredNorm(), 0.1) * slope;
  }
  return position;
}

double ImplicitBody::thickness(const Eigen::Vector3d& point) const {
  double weights = 0, sum = 0;
  for (const auto& bone : bones_) {
    const double weight = std::exp(-distanceToBone(bone, point) / 0.02);
    weights += weight;
    sum += weight * touchingSphere(bone, point).radius;
  }
  return sum / weights;
}

std::pair<Eigen::Vector3d, Eigen::Vector3d> ImplicitBody::bounds() const {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const auto& bone : bones_) {
    const double margin = std::max(bone.joint_radius, bone.end_radius) + 2 * (kJointBlend + kLimbBlend);
    low = low.cwiseMin(bone.joint.cwiseMin(bone.end) - Eigen::Vector3d::Constant(margin));
    high = high.cwiseMax(bone.joint.cwiseMax(bone.end) + Eigen::Vector3d::Constant(margin));
  }
  return {low, high};
}

}  // namespace shaped
