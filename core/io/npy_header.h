#pragma once

#include <bit>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace shaped {

enum class NpyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kInt64, kFloat32, kFloat64 };

/// Bytes of one number of the type.
std::size_t sizeOf(NpyType type);

/// What stands before the numbers of a NumPy .npy file (format versions 1, 2 and 3).
struct NpyHeader {
  NpyType type = NpyType::kFloat64;
  std::endian order = std::endian::little;
  std::vector<std::int64_t> shape;  ///< empty for a single number
  std::uint64_t size = 0;           ///< bytes up to the first number

  /// Product of the shape; the parser has checked that it and the byte count fit in 63 bits.
  std::int64_t valueCount() const;
};

/// The most bytes a header may need: what to read of a file before parseNpyHeader.
constexpr std::size_t kMostNpyHeaderBytes = 65536;

/// Parses the header at the start of a file of file_size bytes, of which `bytes` are the first ones (the whole header,
/// or kMostNpyHeaderBytes). Throws InvalidInput naming the file when it is no .npy file, holds another type or
/// column-major order, or when the shape does not match the size of the file.
NpyHeader parseNpyHeader(const std::string& file, std::string_view bytes, std::uint64_t file_size);

/// A version 1 header for little-endian numbers, padded so that its size is `size` (or the next multiple of 64 when 0).
std::string formatNpyHeader(NpyType type, const std::vector<std::int64_t>& shape, std::size_t size = 0);

}  // namespace shaped
