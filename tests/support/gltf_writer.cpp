#include "tests/support/gltf_writer.h"

#include <algorithm>
#include <bit>

namespace shaped::test {
namespace {

static_assert(std::endian::native == std::endian::little);

std::string base64(std::string_view bytes) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += i + k <= bytes.size() ? digits[group >> (18 - 6 * k) & 63u] : '=';
  }
  return text;
}

template <class Number>
std::string_view bytesOf(const std::vector<Number>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Number)};
}

/// The smallest and largest of each component, which times and positions must have.
template <class Number>
nlohmann::json boundsOf(const std::vector<Number>& values, int components) {
  std::vector<Number> low(values.begin(), values.begin() + components), high = low;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto c = i % static_cast<std::size_t>(components);
    low[c] = std::min(low[c], values[i]);
    high[c] = std::max(high[c], values[i]);
  }
  return {{"min", low}, {"max", high}};
}

}  // namespace

int GltfBuffer::append(std::string_view bytes, int component_type, std::size_t values, int components,
                       nlohmann::json bounds) {
  const char* type = components == 1 ? "SCALAR" : components == 3 ? "VEC3" : components == 4 ? "VEC4" : "MAT4";
  while (bytes_.size() % 4 != 0) bytes_ += '\0';
  views_.push_back({{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", bytes.size()}});
  bytes_ += bytes;
  nlohmann::json accessor = {{"bufferView", views_.size() - 1},
                             {"componentType", component_type},
                             {"count", values / static_cast<std::size_t>(components)},
                             {"type", type}};
  accessor.update(bounds);
  accessors_.push_back(accessor);
  return static_cast<int>(accessors_.size()) - 1;
}

int GltfBuffer::add(const std::vector<float>& values, int components) {
  return append(bytesOf(values), 5126, values.size(), components, boundsOf(values, components));
}

int GltfBuffer::add(const std::vector<std::uint16_t>& values, int components) {
  return append(bytesOf(values), 5123, values.size(), components, boundsOf(values, components));
}

int GltfBuffer::add(const std::vector<Eigen::Affine3d>& transforms) {
  std::vector<float> values;
  for (const auto& transform : transforms)
    for (const double x : transform.matrix().reshaped()) values.push_back(static_cast<float>(x));
  return add(values, 16);
}

void GltfBuffer::finish(nlohmann::json& document) const {
  document["buffers"] = {
      {{"byteLength", bytes_.size()}, {"uri", "data:application/octet-stream;base64," + base64(bytes_)}}};
  document["bufferViews"] = views_;
  document["accessors"] = accessors_;
}

}  // namespace shaped::test
