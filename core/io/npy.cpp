#include "core/io/npy.h"

#include "core/io/byte_reader.h"
#include "core/io/file.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

template <class Number>
void decodeAs(std::string_view bytes, std::endian order, std::span<double> values) {
  const char* at = bytes.data();
  for (double& value : values) value = static_cast<double>(loadNumber<Number>(at, order)), at += sizeof(Number);
}

template <class Number>
void write(const std::filesystem::path& path, NpyType type, const std::vector<std::int64_t>& shape,
           std::span<const Number> values) {
  NpyHeader header;
  header.shape = shape;
  for (const auto extent : shape)
    if (extent < 0) throw InvalidInput(path.string(), "an array cannot have a negative extent");
  if (header.valueCount() != static_cast<std::int64_t>(values.size()))
    throw InvalidInput(path.string(), "the shape needs " + std::to_string(header.valueCount()) + " values, " +
                                          std::to_string(values.size()) + " are given");
  FileWriter writer(path);
  writer.write(formatNpyHeader(type, shape));
  static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory");
  writer.write({reinterpret_cast<const char*>(values.data()), values.size_bytes()});
  writer.commit();
}

}  // namespace

void decodeNpyValues(const NpyHeader& header, std::string_view bytes, std::span<double> values) {
  switch (header.type) {
    case NpyType::kInt8:
      return decodeAs<std::int8_t>(bytes, header.order, values);
    case NpyType::kUint8:
      return decodeAs<std::uint8_t>(bytes, header.order, values);
    case NpyType::kInt16:
      return decodeAs<std::int16_t>(bytes, header.order, values);
    case NpyType::kUint16:
      return decodeAs<std::uint16_t>(bytes, header.order, values);
    case NpyType::kInt32:
      return decodeAs<std::int32_t>(bytes, header.order, values);
    case NpyType::kUint32:
      return decodeAs<std::uint32_t>(bytes, header.order, values);
    case NpyType::kInt64:
      return decodeAs<std::int64_t>(bytes, header.order, values);
    case NpyType::kFloat32:
      return decodeAs<float>(bytes, header.order, values);
    case NpyType::kFloat64:
      return decodeAs<double>(bytes, header.order, values);
  }
}

NpyArray readNpy(const std::filesystem::path& path) {
  const auto bytes = readFile(path);
  const auto header = parseNpyHeader(path.string(), bytes, bytes.size());
  NpyArray array{header.shape, std::vector<double>(static_cast<std::size_t>(header.valueCount()))};
  decodeNpyValues(header, std::string_view(bytes).substr(header.size), array.values);
  return array;
}

NpyArray readNpy(const std::filesystem::path& path, std::span<const std::int64_t> shape) {
  auto array = readNpy(path);
  bool same = array.shape.size() == shape.size();
  for (std::size_t i = 0; same && i < shape.size(); ++i) same = shape[i] < 0 || shape[i] == array.shape[i];
  if (same) return array;
  const auto text = [](std::span<const std::int64_t> extents) {
    std::string list;
    for (const auto extent : extents) list += (list.empty() ? "" : " x ") + (extent < 0 ? "n" : std::to_string(extent));
    return list.empty() ? std::string("a single number") : list;
  };
  throw InvalidInput(path.string(), "is " + text(array.shape) + "; want " + text(shape));
}

void writeNpy(const std::filesystem::path& path, const std::vector<std::int64_t>& shape,
              std::span<const double> values) {
  write(path, NpyType::kFloat64, shape, values);
}

void writeNpy(const std::filesystem::path& path, const std::vector<std::int64_t>& shape,
              std::span<const float> values) {
  write(path, NpyType::kFloat32, shape, values);
}

void writeNpy(const std::filesystem::path& path, const std::vector<std::int64_t>& shape,
              std::span<const std::int32_t> values) {
  write(path, NpyType::kInt32, shape, values);
}

}  // namespace shaped
