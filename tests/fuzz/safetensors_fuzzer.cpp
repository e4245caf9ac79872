#include <memory>

#include "core/io/tensor_file.h"
#include "tests/fuzz/fuzz.h"

using namespace shaped;
using namespace shaped::fuzz;

namespace {

template <class Number>
std::string bytesOf(const TensorFile& file, const std::string& name) {
  const auto values = file.values<Number>(name);
  return {reinterpret_cast<const char*>(values.data()), values.size_bytes()};
}

/// The numbers of a tensor, read through the type that it says it has.
std::string numbersOf(const TensorFile& file, const std::string& name) {
  switch (file.type(name)) {
    case TensorType::kFloat64:
      return bytesOf<double>(file, name);
    case TensorType::kFloat32:
      return bytesOf<float>(file, name);
    case TensorType::kInt64:
      return bytesOf<std::int64_t>(file, name);
    case TensorType::kInt32:
      return bytesOf<std::int32_t>(file, name);
  }
  throw Broken("a tensor has a type");
}

void copy(const TensorFile& file, const std::string& name, TensorWriter& writer) {
  const auto& shape = file.shape(name);
  if (file.type(name) == TensorType::kFloat64) writer.add(name, shape, file.values<double>(name));
  if (file.type(name) == TensorType::kFloat32) writer.add(name, shape, file.values<float>(name));
  if (file.type(name) == TensorType::kInt64) writer.add(name, shape, file.values<std::int64_t>(name));
  if (file.type(name) == TensorType::kInt32) writer.add(name, shape, file.values<std::int32_t>(name));
}

/// Asks for every tensor as a matrix of doubles, which most are not.
void readAsMatrix(const TensorFile& file, const std::string& name) {
  const auto sum = accepted<InvalidInput>([&] { return file.matrix<double>(name).size(); });
  if (sum) require(static_cast<std::size_t>(*sum) * 8 == numbersOf(file, name).size(), "a matrix fills its tensor");
}

}  // namespace

FUZZ_TARGET(safetensors) {
  const auto path = scratchFile("model.safetensors", bytes);
  const auto file = accepted<InvalidInput>([&] { return std::make_unique<TensorFile>(path); });
  if (!file) return;
  TensorWriter writer;
  // a name that the writer does not give is refused, as documented
  const auto copied = accepted<InvalidInput>([&] {
    for (const auto& name : (*file)->names()) readAsMatrix(**file, name), copy(**file, name, writer);
    return true;
  });
  if (!copied) return;
  const auto copy_path = scratchFolder() / "copy.safetensors";
  writer.write(copy_path);
  const TensorFile back(copy_path);
  require(back.names() == (*file)->names(), "names survive");
  for (const auto& name : back.names()) {
    require(back.type(name) == (*file)->type(name) && back.shape(name) == (*file)->shape(name), "shapes survive");
    require(numbersOf(back, name) == numbersOf(**file, name), "numbers survive");
  }
}
