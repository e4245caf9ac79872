#include "tests/support/assimp_witness.h"

namespace shaped::test {
namespace {

/// The key at or before the time, found by walking there, and how far it is to the next.
template <class Key>
std::pair<unsigned, double> place(const Key* keys, unsigned count, double ticks) {
  unsigned k = 0;
  while (k + 1 < count && keys[k + 1].mTime <= ticks) ++k;
  if (k + 1 == count || ticks <= keys[k].mTime) return {k, 0};
  return {k, (ticks - keys[k].mTime) / (keys[k + 1].mTime - keys[k].mTime)};
}

aiVector3D vectorAt(const aiVectorKey* keys, unsigned count, double ticks) {
  const auto [k, share] = place(keys, count, ticks);
  if (share == 0) return keys[k].mValue;
  return keys[k].mValue + (keys[k + 1].mValue - keys[k].mValue) * static_cast<float>(share);
}

aiQuaternion turnAt(const aiQuatKey* keys, unsigned count, double ticks) {
  const auto [k, share] = place(keys, count, ticks);
  aiQuaternion turn = keys[k].mValue;
  if (share > 0) aiQuaternion::Interpolate(turn, keys[k].mValue, keys[k + 1].mValue, static_cast<float>(share));
  return turn.Normalize();
}

aiMatrix4x4 local(const aiNode& node, const aiAnimation* animation, double ticks) {
  for (unsigned c = 0; animation != nullptr && c < animation->mNumChannels; ++c) {
    const auto& channel = *animation->mChannels[c];
    if (!(channel.mNodeName == node.mName)) continue;
    return aiMatrix4x4(vectorAt(channel.mScalingKeys, channel.mNumScalingKeys, ticks),
                       turnAt(channel.mRotationKeys, channel.mNumRotationKeys, ticks),
                       vectorAt(channel.mPositionKeys, channel.mNumPositionKeys, ticks));
  }
  return node.mTransformation;
}

void walk(const aiNode& node, const aiMatrix4x4& parent, const aiAnimation* animation, double ticks,
          std::map<std::string, aiMatrix4x4>& worlds) {
  const aiMatrix4x4 world = parent * local(node, animation, ticks);
  worlds[node.mName.C_Str()] = world;
  for (unsigned c = 0; c < node.mNumChildren; ++c) walk(*node.mChildren[c], world, animation, ticks, worlds);
}

}  // namespace

std::map<std::string, aiMatrix4x4> nodeWorlds(const aiScene& scene, const aiAnimation* animation, double seconds) {
  std::map<std::string, aiMatrix4x4> worlds;
  const double rate = animation != nullptr && animation->mTicksPerSecond > 0 ? animation->mTicksPerSecond : 1;
  walk(*scene.mRootNode, aiMatrix4x4(), animation, seconds * rate, worlds);
  return worlds;
}

}  // namespace shaped::test
