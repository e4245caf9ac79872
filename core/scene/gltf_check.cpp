#include "core/scene/gltf_check.h"

#include <map>
#include <optional>
#include <vector>

#include "core/io/text_scanner.h"
#include "core/numerics/error.h"
#include "core/scene/gltf_document.h"

namespace shaped {
namespace {

using nlohmann::json;

constexpr std::int64_t kMost = std::int64_t{1} << 40;  ///< bytes: sums of two stay far from overflow

/// What an accessor gives.
struct Accessor {
  std::string type;
  std::int64_t component, count;
};

class Checker {
 public:
  Checker(const std::string& file, const GltfDocument& document)
      : root_{file, document.json, ""},
        binary_(document.binary),
        nodes_(entries("nodes")),
        meshes_(entries("meshes")),
        skins_(entries("skins")) {}

  void check() {
    refuseExtensions();
    readBuffers();
    readViews();
    readAccessors();
    for (const auto& mesh : meshes_) checkMesh(mesh);
    for (const auto& skin : skins_) checkSkin(skin);
    checkNodes();
    for (const auto& animation : root_.list("animations")) checkAnimation(animation);
  }

 private:
  std::vector<GltfEntry> entries(const char* field) const {
    if (!root_.fields.is_object()) throw InvalidInput(root_.file, "is no JSON object");
    return root_.list(field);
  }

  void refuseExtensions() const {
    const auto found = root_.fields.find("extensionsRequired");
    if (found == root_.fields.end()) return;
    for (const auto& name : *found)
      if (!name.is_string() || !name.get_ref<const std::string&>().starts_with("KHR_materials_"))
        throw InvalidInput(root_.file,
                           "requires the extension " + quotedWord(name.dump()) + ", which is not understood");
  }

  void readBuffers() {
    for (const auto& buffer : root_.list("buffers")) {
      const auto length = buffer.whole("byteLength", 1, kMost);
      // What a URI brings is for assimp to compare with the length.
      if (!buffer.has("uri") && (!sizes_.empty() || !binary_ || length > *binary_))
        buffer.fail("has no uri and is longer than what follows in the file");
      sizes_.push_back(length);
    }
  }

  void readViews() {
    for (const auto& view : root_.list("bufferViews")) {
      const auto buffer = static_cast<std::size_t>(view.whole("buffer", 0, last(sizes_)));
      const auto length = view.whole("byteLength", 1, kMost);
      if (view.whole("byteOffset", 0, kMost, 0) + length > sizes_[buffer]) view.fail("reaches beyond its buffer");
      view_lengths_.push_back(length);
      strides_.push_back(view.whole("byteStride", 4, 252, 0));
    }
  }

  void readAccessors() {
    static const std::map<std::string, std::int64_t> components{{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4},
                                                                {"MAT2", 4},   {"MAT3", 9}, {"MAT4", 16}};
    static const std::map<std::int64_t, std::int64_t> bytes{{5120, 1}, {5121, 1}, {5122, 2},
                                                            {5123, 2}, {5125, 4}, {5126, 4}};
    for (const auto& accessor : root_.list("accessors")) {
      const auto type = accessor.fields.find("type");
      const auto known = type != accessor.fields.end() && type->is_string() ? components.find(type->get<std::string>())
                                                                            : components.end();
      const auto size = bytes.find(accessor.whole("componentType", 5120, 5126));
      if (known == components.end() || size == bytes.end()) accessor.fail("has a type that glTF does not know");
      if (accessor.has("sparse")) accessor.fail("is sparse, which is not understood");
      const auto view = static_cast<std::size_t>(accessor.whole("bufferView", 0, last(view_lengths_)));
      const auto count = accessor.whole("count", 1, kMost / 256);
      const auto element = known->second * size->second, stride = strides_[view] > 0 ? strides_[view] : element;
      if (accessor.whole("byteOffset", 0, kMost, 0) + (count - 1) * stride + element > view_lengths_[view])
        accessor.fail("reaches beyond its buffer view");
      accessors_.push_back({known->first, size->first, count});
    }
  }

  const Accessor& accessor(const GltfEntry& entry, const char* field) const {
    return accessors_[static_cast<std::size_t>(entry.whole(field, 0, last(accessors_)))];
  }

  void checkMesh(const GltfEntry& mesh) const {
    const auto primitives = mesh.list("primitives");
    if (primitives.empty()) mesh.fail("has no primitives");
    for (const auto& primitive : primitives) {
      const auto attributes = primitive.object("attributes");
      const auto& positions = accessor(attributes, "POSITION");
      if (positions.type != "VEC3" || positions.component != 5126) attributes.fail("needs VEC3 of floats as POSITION");
      for (const auto& [name, value] : attributes.fields.items()) {
        const auto& values = accessor(attributes, name.c_str());
        if (values.count != positions.count)
          attributes.fail("has another count of " + quotedWord(name) + " than of POSITION");
        if ((name.starts_with("JOINTS_") || name.starts_with("WEIGHTS_")) && values.type != "VEC4")
          attributes.fail("needs VEC4 as " + name);
        if (name.starts_with("JOINTS_") && values.component != 5121 && values.component != 5123)
          attributes.fail("needs bytes or shorts without sign as " + name);
      }
      if (attributes.has("JOINTS_0") != attributes.has("WEIGHTS_0"))
        attributes.fail("has JOINTS_0 without WEIGHTS_0 or WEIGHTS_0 without JOINTS_0");
      if (primitive.has("indices") && accessor(primitive, "indices").type != "SCALAR")
        primitive.fail("needs SCALAR as indices");
      for (const auto& target : primitive.list("targets"))
        for (const auto& [name, value] : target.fields.items())
          if (accessor(target, name.c_str()).count != positions.count) target.fail("has another count than POSITION");
    }
  }

  void checkSkin(const GltfEntry& skin) const {
    const auto joints = skin.indices("joints", nodes_.size());
    if (joints.empty()) skin.fail("has no joints");
    const auto& binds = accessor(skin, "inverseBindMatrices");  // which glTF lets be left out, and assimp does not
    if (binds.type != "MAT4" || binds.component != 5126 || binds.count < static_cast<std::int64_t>(joints.size()))
      skin.fail("needs MAT4 of floats for each of its joints as inverseBindMatrices");
    skin.whole("skeleton", 0, last(nodes_), 0);
  }

  /// Every node hangs on one other at most, and none on itself: walked down from those that hang on nothing, all are
  /// met.
  void checkNodes() const {
    std::vector<std::vector<std::int64_t>> children;
    std::vector<int> parents(nodes_.size(), 0);
    for (const auto& node : nodes_) {
      if (node.has("mesh")) node.whole("mesh", 0, last(meshes_));
      if (node.has("skin")) node.whole("skin", 0, last(skins_));
      children.push_back(node.indices("children", nodes_.size()));
      for (const auto child : children.back())
        if (++parents[static_cast<std::size_t>(child)] > 1)
          node.fail("has the child " + std::to_string(child) + ", which hangs on another");
    }
    requireShallow(children, parents);
    const auto scenes = root_.list("scenes");
    if (scenes.empty()) throw InvalidInput(root_.file, "has no scenes");
    root_.whole("scene", 0, last(scenes), 0);
    for (const auto& scene : scenes)
      for (const auto node : scene.indices("nodes", nodes_.size()))
        if (parents[static_cast<std::size_t>(node)] > 0)
          scene.fail("has node " + std::to_string(node) + ", which hangs on another");
  }

  /// assimp descends by recursion.
  void requireShallow(const std::vector<std::vector<std::int64_t>>& children, const std::vector<int>& parents) const {
    constexpr int deepest = 1000;
    std::vector<std::pair<std::size_t, int>> met;
    for (std::size_t n = 0; n < parents.size(); ++n)
      if (parents[n] == 0) met.emplace_back(n, 1);
    for (std::size_t i = 0; i < met.size(); ++i) {
      const auto [node, depth] = met[i];
      if (depth > deepest) nodes_[node].fail("lies deeper than " + std::to_string(deepest) + " nodes");
      for (const auto child : children[node]) met.emplace_back(static_cast<std::size_t>(child), depth + 1);
    }
    if (met.size() != nodes_.size()) throw InvalidInput(root_.file, "has nodes that hang on each other in a ring");
  }

  void checkAnimation(const GltfEntry& animation) const {
    const auto samplers = animation.list("samplers");
    for (const auto& sampler : samplers) {
      const auto &times = accessor(sampler, "input"), &values = accessor(sampler, "output");
      if (times.type != "SCALAR" || times.component != 5126) sampler.fail("needs SCALAR of floats as input");
      if (values.count < times.count) sampler.fail("has fewer values than times");
    }
    for (const auto& channel : animation.list("channels")) {
      const auto index = static_cast<std::size_t>(channel.whole("sampler", 0, last(samplers)));
      const auto target = channel.object("target");
      target.whole("node", 0, last(nodes_));
      checkValues(samplers[index], target);
    }
  }

  void checkValues(const GltfEntry& sampler, const GltfEntry& target) const {
    const auto path = target.fields.find("path");
    const std::string kind = path != target.fields.end() && path->is_string() ? path->get<std::string>() : "";
    const auto& values = accessor(sampler, "output");
    const bool fits = kind == "rotation"  ? values.type == "VEC4"
                      : kind == "weights" ? values.type == "SCALAR"
                                          : (kind == "translation" || kind == "scale") && values.type == "VEC3";
    if (!fits || (kind != "rotation" && values.component != 5126))
      target.fail("has a path and values that do not fit each other");
  }

  template <class List>
  static std::int64_t last(const List& list) {
    return static_cast<std::int64_t>(list.size()) - 1;
  }

  GltfEntry root_;
  std::optional<std::int64_t> binary_;
  std::vector<GltfEntry> nodes_, meshes_, skins_;
  std::vector<std::int64_t> sizes_, view_lengths_, strides_;
  std::vector<Accessor> accessors_;
};

}  // namespace

void requireSoundGltf(const std::string& file, std::string_view bytes) {
  const auto document = readGltfDocument(file, bytes);
  Checker(file, document).check();
}

}  // namespace shaped
