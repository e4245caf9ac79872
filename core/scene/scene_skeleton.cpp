#include "core/scene/scene_skeleton.h"

#include <map>
#include <ranges>
#include <span>

#include "core/io/text_scanner.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

/// What hangs on a node, itself included.
struct Burden {
  std::int32_t bone = -1;  ///< that the node itself is
  bool carries = false;    ///< whether this bone moves vertices
  bool leads_to_bones = false, leads_to_vertices = false;
};

class JointFinder {
 public:
  JointFinder(const std::string& file, const aiScene& scene, const SkinnedMesh& mesh) : root_(scene.mRootNode) {
    const auto nodes = parentsFirst();
    for (std::size_t b = 0; b < mesh.bones.size(); ++b)
      place(file, nodes, mesh.bones[b].name, static_cast<std::int32_t>(b));
    std::vector<bool> carries(mesh.bones.size(), false);
    for (Eigen::Index v = 0; v < mesh.weights.rows(); ++v)
      for (SkinWeights::InnerIterator entry(mesh.weights, v); entry; ++entry)
        carries[static_cast<std::size_t>(entry.col())] = true;
    for (const aiNode* node : std::views::reverse(nodes)) {
      auto& burden = burdens_[node];
      burden.carries = burden.bone >= 0 && carries[static_cast<std::size_t>(burden.bone)];
      burden.leads_to_bones = burden.bone >= 0;
      burden.leads_to_vertices = burden.carries;
      for (const aiNode* child : children(node)) {
        burden.leads_to_bones |= burdens_[child].leads_to_bones;
        burden.leads_to_vertices |= burdens_[child].leads_to_vertices;
      }
    }
  }

  std::vector<SceneJoint> joints() {
    const aiNode* root = rootJoint();
    std::vector<SceneJoint> found, waiting{joint(root, -1)};
    while (!waiting.empty()) {
      const auto next = waiting.back();
      waiting.pop_back();
      const auto index = static_cast<std::int32_t>(found.size());
      found.push_back(next);
      const auto below = children(next.node);
      for (const aiNode* child : std::views::reverse(below))
        if (burdens_[child].leads_to_bones) waiting.push_back(joint(child, index));
    }
    return found;
  }

 private:
  static std::span<aiNode* const> children(const aiNode* node) { return {node->mChildren, node->mNumChildren}; }

  SceneJoint joint(const aiNode* node, std::int32_t parent) {
    return {node, parent, burdens_[node].bone, burdens_[node].leads_to_vertices};
  }

  std::vector<const aiNode*> parentsFirst() const {
    std::vector<const aiNode*> nodes{root_};
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const auto below = children(nodes[i]);
      nodes.insert(nodes.end(), below.begin(), below.end());
    }
    return nodes;
  }

  /// Notes which node the bone is.
  void place(const std::string& file, const std::vector<const aiNode*>& nodes, const std::string& name,
             std::int32_t bone) {
    const aiNode* found = nullptr;
    for (const aiNode* node : nodes) {
      if (name != node->mName.C_Str()) continue;
      if (found != nullptr)
        throw InvalidInput(file,
                           "has two nodes named " + quotedWord(name) + ", which is a joint; give each its own name");
      found = node;
    }
    if (found == nullptr) throw InvalidInput(file, "has no node for joint " + quotedWord(name));
    burdens_[found].bone = bone;
  }

  /// Down from the top past nodes that carry nothing and lead to vertices by a single child.
  const aiNode* rootJoint() {
    const aiNode* root = root_;
    while (!burdens_[root].carries) {
      const aiNode* only = nullptr;
      for (const aiNode* child : children(root)) {
        if (!burdens_[child].leads_to_vertices) continue;
        if (only != nullptr) return root;
        only = child;
      }
      root = only;
    }
    return root;
  }

  const aiNode* root_;
  std::map<const aiNode*, Burden> burdens_;
};

}  // namespace

std::vector<SceneJoint> sceneJoints(const std::string& file, const aiScene& scene, const SkinnedMesh& mesh) {
  return JointFinder(file, scene, mesh).joints();
}

}  // namespace shaped
