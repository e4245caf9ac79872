#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/io/npy_header.h"

namespace shaped {

/// An array of any shape, row-major.
struct NpyArray {
  std::vector<std::int64_t> shape;
  std::vector<double> values;  ///< as many as the product of the shape; integers up to 2^53 are exact
};

/// Numbers as they lie in a .npy file, as doubles. bytes: header.type numbers back to back; values: as many.
void decodeNpyValues(const NpyHeader& header, std::string_view bytes, std::span<double> values);

/// Reads a whole .npy file: integers or floats, either byte order, row-major. Throws InvalidInput naming the file when
/// it cannot be opened, is truncated, of another type, or its header does not match its length; FileError when reading
/// fails.
NpyArray readNpy(const std::filesystem::path& path);

/// As readNpy, with the shape checked: -1 in `shape` stands for any extent.
NpyArray readNpy(const std::filesystem::path& path, std::span<const std::int64_t> shape);

/// Writes a .npy file of doubles, floats or 32-bit integers; it appears only when complete. Throws InvalidInput when
/// values.size() is not the product of the shape, FileError when writing fails.
void writeNpy(const std::filesystem::path& path, const std::vector<std::int64_t>& shape,
              std::span<const double> values);
void writeNpy(const std::filesystem::path& path, const std::vector<std::int64_t>& shape, std::span<const float> values);
void writeNpy(const std::filesystem::path& path, const std::vector<std::int64_t>& shape,
              std::span<const std::int32_t> values);

}  // namespace shaped
