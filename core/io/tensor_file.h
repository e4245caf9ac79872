#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/mesh/types.h"

namespace shaped {

enum class TensorType { kFloat64, kFloat32, kInt64, kInt32 };

/// The tensor type of a C++ number.
template <class Number>
constexpr TensorType tensorTypeOf();
template <>
constexpr TensorType tensorTypeOf<double>() {
  return TensorType::kFloat64;
}
template <>
constexpr TensorType tensorTypeOf<float>() {
  return TensorType::kFloat32;
}
template <>
constexpr TensorType tensorTypeOf<std::int64_t>() {
  return TensorType::kInt64;
}
template <>
constexpr TensorType tensorTypeOf<std::int32_t>() {
  return TensorType::kInt32;
}

template <class Number>
using RowMajorMatrix = Eigen::Matrix<Number, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// A safetensors file mapped into memory: named row-major arrays, read without a copy and without running any code.
/// Format: 8 bytes header length, a JSON header (name -> dtype, shape, data_offsets), then the numbers, little-endian.
/// Immutable, so usable from any thread; the file must not be shortened while it is open. Views live as long as it
/// does.
class TensorFile {
 public:
  /// Maps and checks the file. name: what errors call it; its path where empty. Throws InvalidInput naming the file
  /// when it cannot be opened or is no regular file, when the header is larger than the file or no JSON of that form,
  /// holds a name twice or a dtype other than F64, F32, I64 and I32, or when the tensors do not fill the data exactly
  /// one after the other, each aligned to its numbers.
  explicit TensorFile(const std::filesystem::path& path, std::string name = {});
  ~TensorFile();
  TensorFile(const TensorFile&) = delete;
  TensorFile& operator=(const TensorFile&) = delete;

  std::vector<std::string> names() const;
  bool has(std::string_view name) const { return tensors_.find(name) != tensors_.end(); }
  /// Throws InvalidInput when there is no tensor of that name, as do the functions below.
  const std::vector<std::int64_t>& shape(std::string_view name) const { return find(name).shape; }
  TensorType type(std::string_view name) const { return find(name).type; }

  /// All numbers, row-major. Throws InvalidInput when the tensor is of another type.
  template <class Number>
  std::span<const Number> values(std::string_view name) const {
    const auto bytes = bytesOf(name, tensorTypeOf<Number>());
    return {reinterpret_cast<const Number*>(bytes.data()), bytes.size() / sizeof(Number)};
  }

  /// The two-dimensional tensor as a matrix. -1 stands for any extent. Throws InvalidInput when type or shape differ.
  template <class Number>
  Eigen::Map<const RowMajorMatrix<Number>> matrix(std::string_view name, Eigen::Index rows = -1,
                                                  Eigen::Index columns = -1) const {
    requireShape(name, {rows, columns});
    const auto& extents = shape(name);
    return {values<Number>(name).data(), extents[0], extents[1]};
  }

  /// Throws InvalidInput naming file, tensor and shape when the shape differs; -1 stands for any extent.
  void requireShape(std::string_view name, std::initializer_list<std::int64_t> shape) const;

  /// The metadata of the header: text by name.
  const std::map<std::string, std::string>& metadata() const { return metadata_; }
  /// The whole file.
  std::string_view bytes() const { return mapping_; }
  /// Gives the whole file to a sink, piece by piece, and has the disk read ahead meanwhile. Afterwards it is in memory
  /// if there is room. Throws InvalidInput when the disk cannot read it.
  void readThrough(const std::function<void(std::string_view)>& sink) const;

 private:
  struct Tensor {
    TensorType type;
    std::vector<std::int64_t> shape;
    std::size_t begin, end;  ///< in the data
  };

  void readHeader();
  void addTensor(const std::string& name, const nlohmann::json& description);
  void requireSeamless() const;
  const Tensor& find(std::string_view name) const;
  std::string_view bytesOf(std::string_view name, TensorType type) const;

  std::string file_;
  std::string_view mapping_, data_;
  std::map<std::string, Tensor, std::less<>> tensors_;
  std::map<std::string, std::string> metadata_;
};

/// Collects tensors and writes them as a safetensors file. The numbers are copied when they are added.
class TensorWriter {
 public:
  /// Row-major numbers. Throws InvalidInput when the name is empty, reserved or taken, or when the shape does not
  /// match.
  void add(const std::string& name, const std::vector<std::int64_t>& shape, std::span<const double> values);
  void add(const std::string& name, const std::vector<std::int64_t>& shape, std::span<const float> values);
  void add(const std::string& name, const std::vector<std::int64_t>& shape, std::span<const std::int64_t> values);
  void add(const std::string& name, const std::vector<std::int64_t>& shape, std::span<const std::int32_t> values);

  /// A matrix of any storage order as a tensor of shape rows x columns.
  template <class Derived>
  void addMatrix(const std::string& name, const Eigen::MatrixBase<Derived>& matrix) {
    using Number = typename Derived::Scalar;
    const RowMajorMatrix<Number> copy = matrix;
    add(name, {copy.rows(), copy.cols()}, std::span<const Number>(copy.data(), static_cast<std::size_t>(copy.size())));
  }

  /// Text for the header, read back by TensorFile::metadata(); must be UTF-8.
  void setMetadata(const std::string& key, const std::string& text) { metadata_[key] = text; }

  /// Gives the file's bytes to a sink, piece by piece.
  void write(const std::function<void(std::string_view)>& sink) const;
  /// Writes the file; it appears only when complete. Throws FileError.
  void write(const std::filesystem::path& path) const;

 private:
  struct Tensor {
    std::string name;
    TensorType type;
    std::vector<std::int64_t> shape;
    std::string bytes;
  };

  template <class Number>
  void addNumbers(const std::string& name, const std::vector<std::int64_t>& shape, std::span<const Number> values);

  std::vector<Tensor> tensors_;
  std::map<std::string, std::string> metadata_;
};

}  // namespace shaped
