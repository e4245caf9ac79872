#include "tests/fuzz/edited_model.h"

#include <cstring>
#include <map>

#include "tests/fuzz/fuzz.h"

namespace shaped::fuzz {
namespace {

struct RawTensor {
  TensorType type;
  std::vector<std::int64_t> shape;
  std::string bytes;
};
using RawTensors = std::map<std::string, RawTensor>;

struct Edit {
  std::uint8_t tensor, kind;
  std::uint16_t index;
  std::int64_t value;
};

std::size_t sizeOf(TensorType type) { return type == TensorType::kFloat64 || type == TensorType::kInt64 ? 8 : 4; }

template <class Number>
RawTensor rawTensor(const TensorFile& file, const std::string& name) {
  const auto values = file.values<Number>(name);
  return {file.type(name), file.shape(name), {reinterpret_cast<const char*>(values.data()), values.size_bytes()}};
}

RawTensors tensorsOf(const TensorFile& file) {
  RawTensors tensors;
  for (const auto& name : file.names())
    tensors[name] =
        file.type(name) == TensorType::kFloat64 ? rawTensor<double>(file, name) : rawTensor<std::int32_t>(file, name);
  return tensors;
}

/// Bytes of a row along the first extent.
std::size_t rowBytes(const RawTensor& tensor) {
  std::size_t bytes = sizeOf(tensor.type);
  for (std::size_t i = 1; i < tensor.shape.size(); ++i) bytes *= static_cast<std::size_t>(tensor.shape[i]);
  return bytes;
}

void setValue(RawTensor& tensor, const Edit& edit) {
  const auto size = sizeOf(tensor.type), count = tensor.bytes.size() / size;
  if (count > 0) std::memcpy(tensor.bytes.data() + edit.index % count * size, &edit.value, size);
}

void resize(RawTensor& tensor, const Edit& edit) {
  constexpr int most = 128;
  if (tensor.shape.empty() || tensor.bytes.empty()) return;
  const auto row = rowBytes(tensor);
  tensor.shape[0] = edit.index % most;
  tensor.bytes.resize(static_cast<std::size_t>(tensor.shape[0]) * row);
}

/// No numbers, but any extents.
void emptyOut(RawTensor& tensor, const Edit& edit) {
  const std::int64_t extent = edit.value & (INT64_MAX >> 3);
  tensor.shape.assign(std::max<std::size_t>(tensor.shape.size(), 1), 0);
  if (tensor.shape.size() > 1) tensor.shape[edit.index % tensor.shape.size()] = extent;
  tensor.bytes.clear();
}

void applyEdit(const Edit& edit, RawTensors& tensors) {
  if (tensors.empty()) return;
  const auto chosen = std::next(tensors.begin(), edit.tensor % static_cast<int>(tensors.size()));
  switch (edit.kind % 5) {
    case 0:
      return setValue(chosen->second, edit);
    case 1:
      return resize(chosen->second, edit);
    case 2:
      return emptyOut(chosen->second, edit);
    case 3:
      for (auto i = 0U; i * sizeOf(chosen->second.type) < chosen->second.bytes.size(); ++i)
        setValue(chosen->second, {0, 0, static_cast<std::uint16_t>(i), edit.value});
      return;
    case 4:
      tensors.erase(chosen);
  }
}

RawTensors edited(RawTensors tensors, std::string_view bytes) {
  constexpr std::size_t edit_bytes = 12;
  for (; bytes.size() >= edit_bytes; bytes.remove_prefix(edit_bytes)) {
    Edit edit{static_cast<std::uint8_t>(bytes[0]), static_cast<std::uint8_t>(bytes[1]), 0, 0};
    std::memcpy(&edit.index, bytes.data() + 2, 2);
    std::memcpy(&edit.value, bytes.data() + 4, 8);
    applyEdit(edit, tensors);
  }
  return tensors;
}

template <class Number>
void add(TensorWriter& writer, const std::string& name, const RawTensor& tensor) {
  std::vector<Number> values(tensor.bytes.size() / sizeof(Number));
  if (!values.empty()) std::memcpy(values.data(), tensor.bytes.data(), tensor.bytes.size());
  writer.add(name, tensor.shape, std::span<const Number>(values));
}

std::shared_ptr<const TensorFile> tensorFile(const RawTensors& tensors) {
  TensorWriter writer;
  for (const auto& [name, tensor] : tensors)
    tensor.type == TensorType::kFloat64 ? add<double>(writer, name, tensor) : add<std::int32_t>(writer, name, tensor);
  const auto path = scratchFolder() / "edited.safetensors";
  writer.write(path);
  return std::make_shared<const TensorFile>(path);
}

}  // namespace

std::optional<StoredModel> editedModel(const StoredModel& sound, std::string_view bytes) {
  const auto end = std::min(bytes.find('\0'), bytes.size());
  auto manifest = sound.manifest;
  if (end > 0) manifest.description = nlohmann::json::parse(bytes.substr(0, end), nullptr, false);
  if (!manifest.description.is_object()) return std::nullopt;
  const auto edits = bytes.substr(std::min(end + 1, bytes.size()));
  return StoredModel{"edited", 1, manifest, tensorFile(edited(tensorsOf(*sound.tensors), edits))};
}

}  // namespace shaped::fuzz
