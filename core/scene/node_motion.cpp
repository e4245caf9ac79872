#include "core/scene/node_motion.h"

#include <algorithm>
#include <span>

namespace shaped {
namespace {

Eigen::Vector3d value(const aiVectorKey& key) { return {key.mValue.x, key.mValue.y, key.mValue.z}; }

Eigen::Quaterniond value(const aiQuatKey& key) {
  return Eigen::Quaterniond(key.mValue.w, key.mValue.x, key.mValue.y, key.mValue.z).normalized();
}

Eigen::Vector3d between(const Eigen::Vector3d& one, const Eigen::Vector3d& other, double share) {
  return one + share * (other - one);
}

Eigen::Quaterniond between(const Eigen::Quaterniond& one, const Eigen::Quaterniond& other, double share) {
  return one.slerp(share, other);
}

/// keys: in the order of their times, at least one.
template <class Key>
auto sampled(std::span<const Key> keys, double ticks) {
  const auto after =
      std::upper_bound(keys.begin(), keys.end(), ticks, [](double time, const Key& key) { return time < key.mTime; });
  if (after == keys.begin()) return value(keys.front());
  if (after == keys.end()) return value(keys.back());
  const Key& before = *(after - 1);
  return between(value(before), value(*after), (ticks - before.mTime) / (after->mTime - before.mTime));
}

/// A transform without shear, part by part.
struct Parts {
  Eigen::Vector3d translation, scale;
  Eigen::Quaterniond rotation;

  explicit Parts(const Eigen::Affine3d& transform)
      : translation(transform.translation()), scale(transform.linear().colwise().norm().transpose()) {
    const Eigen::Vector3d divisor = scale.unaryExpr([](double length) { return length > 0 ? length : 1.0; });
    rotation =
        Eigen::Quaterniond(Eigen::Matrix3d(transform.linear() * divisor.cwiseInverse().asDiagonal())).normalized();
  }
};

}  // namespace

NodeMotion::NodeMotion(const aiScene& scene, const aiAnimation* animation) {
  if (animation == nullptr) return;
  if (animation->mTicksPerSecond > 0) ticks_per_second_ = animation->mTicksPerSecond;
  duration_ = animation->mDuration / ticks_per_second_;
  for (const aiNodeAnim* channel : std::span(animation->mChannels, animation->mNumChannels))
    if (const aiNode* node = scene.mRootNode->FindNode(channel->mNodeName)) channels_[node] = channel;
}

Eigen::Affine3d NodeMotion::local(const aiNode& node, double seconds) const {
  const Eigen::Affine3d still = affine(node.mTransformation);
  const auto found = channels_.find(&node);
  if (found == channels_.end()) return still;
  Parts parts(still);
  const auto& channel = *found->second;
  const double ticks = seconds * ticks_per_second_;
  if (channel.mNumPositionKeys > 0)
    parts.translation = sampled<aiVectorKey>({channel.mPositionKeys, channel.mNumPositionKeys}, ticks);
  if (channel.mNumRotationKeys > 0)
    parts.rotation = sampled<aiQuatKey>({channel.mRotationKeys, channel.mNumRotationKeys}, ticks);
  if (channel.mNumScalingKeys > 0)
    parts.scale = sampled<aiVectorKey>({channel.mScalingKeys, channel.mNumScalingKeys}, ticks);
  Eigen::Affine3d moved = Eigen::Affine3d::Identity();
  moved.translation() = parts.translation;
  moved.linear() = parts.rotation.toRotationMatrix() * parts.scale.asDiagonal();
  return moved;
}

Eigen::Affine3d NodeMotion::world(const aiNode& node, double seconds) const {
  Eigen::Affine3d transform = local(node, seconds);
  for (const aiNode* parent = node.mParent; parent != nullptr; parent = parent->mParent)
    transform = local(*parent, seconds) * transform;
  return transform;
}

}  // namespace shaped
