#pragma once

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace shaped::test {

/// The data of a glTF file being made by hand: accessors in one embedded buffer.
class GltfBuffer {
 public:
  /// Floats, `components` of them an element (1: SCALAR, 3: VEC3, 4: VEC4, 16: MAT4). Returns the accessor's index.
  int add(const std::vector<float>& values, int components);
  /// Indices or joints.
  int add(const std::vector<std::uint16_t>& values, int components);
  /// Matrices, column by column.
  int add(const std::vector<Eigen::Affine3d>& transforms);

  /// Puts buffers, views and accessors into the document.
  void finish(nlohmann::json& document) const;

 private:
  int append(std::string_view bytes, int component_type, std::size_t values, int components, nlohmann::json bounds);

  std::string bytes_;
  nlohmann::json views_ = nlohmann::json::array(), accessors_ = nlohmann::json::array();
};

}  // namespace shaped::test
