#include "core/io/tensor_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <system_error>

#include "core/io/byte_reader.h"
#include "core/io/file.h"
#include "core/io/text_scanner.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

using nlohmann::json;

static_assert(std::endian::native == std::endian::little, "tensors are used as they lie in the file");

constexpr std::size_t kMostHeaderBytes = 100'000'000;
constexpr const char* kMetadata = "__metadata__";
constexpr std::size_t kPiece = std::size_t{2} << 20;   ///< of reading through a file; whole pages
constexpr std::size_t kAhead = std::size_t{16} << 20;  ///< what the disk is asked for before it is wanted
constexpr int kPopulateRead = 22;                      ///< MADV_POPULATE_READ, which older C libraries do not name

struct TypeName {
  TensorType type;
  const char* name;
  std::size_t size;
};

constexpr std::array kTypes{TypeName{TensorType::kFloat64, "F64", 8}, TypeName{TensorType::kFloat32, "F32", 4},
                            TypeName{TensorType::kInt64, "I64", 8}, TypeName{TensorType::kInt32, "I32", 4}};

const TypeName& nameOf(TensorType type) {
  return *std::find_if(kTypes.begin(), kTypes.end(), [&](const TypeName& known) { return known.type == type; });
}

/// Bytes of an array; nothing when they do not fit in 63 bits or an extent is negative.
std::optional<std::int64_t> byteCount(TensorType type, const std::vector<std::int64_t>& shape) {
  auto bytes = static_cast<std::int64_t>(nameOf(type).size);
  for (const auto extent : shape)
    if (extent < 0 || __builtin_mul_overflow(bytes, extent, &bytes)) return std::nullopt;
  return bytes;
}

std::string describe(std::span<const std::int64_t> shape) {
  std::string text;
  for (const auto extent : shape) text += (text.empty() ? "" : " x ") + (extent < 0 ? "n" : std::to_string(extent));
  return text.empty() ? "a single number" : text;
}

/// Parses JSON; a name that stands twice in an object is an error, which the parser by itself lets pass.
json parseStrictly(const std::string& file, std::string_view text) {
  std::vector<std::set<std::string>> names;
  const auto watch = [&](int, json::parse_event_t event, json& parsed) {
    if (event == json::parse_event_t::object_start) names.emplace_back();
    if (event == json::parse_event_t::object_end) names.pop_back();
    if (event == json::parse_event_t::key && !names.back().insert(parsed.get<std::string>()).second)
      throw InvalidInput(file, "has " + quotedWord(parsed.get<std::string>()) + " twice in its header");
    return true;
  };
  try {
    return json::parse(text, watch);
  } catch (const json::exception&) {
    throw InvalidInput(file, "has a header that is no JSON");
  }
}

bool isTensorDescription(const json& entry) {
  const auto wholeNumbers = [&](const char* key) {
    return entry.contains(key) && entry[key].is_array() &&
           std::all_of(entry[key].begin(), entry[key].end(), [](const json& number) {
             return number.is_number_unsigned() && number.get<std::uint64_t>() < (std::uint64_t{1} << 63);
           });
  };
  return entry.is_object() && entry.size() == 3 && entry.contains("dtype") && entry["dtype"].is_string() &&
         wholeNumbers("shape") && wholeNumbers("data_offsets") && entry["data_offsets"].size() == 2;
}

std::string_view mapFile(const std::filesystem::path& path, const std::string& file) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) throw InvalidInput(file, "cannot be opened: " + std::generic_category().message(errno));
  struct stat status {};
  const bool regular = ::fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode);
  const auto size = regular ? static_cast<std::size_t>(status.st_size) : 0;
  void* memory = size > 0 ? ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, descriptor, 0) : MAP_FAILED;
  const int error = errno;
  ::close(descriptor);
  if (!regular) throw InvalidInput(file, "is not a regular file");
  if (size == 0) throw InvalidInput(file, "is empty");
  if (memory == MAP_FAILED) throw InvalidInput(file, "cannot be mapped: " + std::generic_category().message(error));
  return {static_cast<const char*>(memory), size};
}

}  // namespace

TensorFile::TensorFile(const std::filesystem::path& path, std::string name)
    : file_(name.empty() ? path.string() : std::move(name)), mapping_(mapFile(path, file_)) {
  try {
    readHeader();
  } catch (...) {
    ::munmap(const_cast<char*>(mapping_.data()), mapping_.size());
    throw;
  }
}

TensorFile::~TensorFile() { ::munmap(const_cast<char*>(mapping_.data()), mapping_.size()); }

void TensorFile::readHeader() {
  ByteReader reader(file_, mapping_);
  const auto length = reader.number<std::uint64_t>(std::endian::little);
  if (length > kMostHeaderBytes || length > reader.remaining())
    throw InvalidInput(file_, "is no tensor file or truncated: its header should have " + std::to_string(length) +
                                  " bytes, " + std::to_string(reader.remaining()) + " are there");
  const auto header = parseStrictly(file_, reader.take(length));
  data_ = mapping_.substr(reader.position());
  if (!header.is_object()) throw InvalidInput(file_, "has a header that is no JSON object");
  for (const auto& [name, description] : header.items()) {
    if (name != kMetadata) {
      addTensor(name, description);
      continue;
    }
    if (!description.is_object()) throw InvalidInput(file_, "has metadata that are no object");
    for (const auto& [key, value] : description.items()) {
      if (!value.is_string()) throw InvalidInput(file_, "has metadata " + quotedWord(key) + " that are no text");
      metadata_[key] = value.get<std::string>();
    }
  }
  requireSeamless();
}

void TensorFile::addTensor(const std::string& name, const json& description) {
  const auto fail = [&](const std::string& problem) {
    throw InvalidInput(file_, "tensor " + quotedWord(name) + " " + problem);
  };
  if (!isTensorDescription(description)) fail("is not described by dtype, shape and data_offsets alone");
  const auto type = description["dtype"].get<std::string>();
  const auto* known = std::find_if(kTypes.begin(), kTypes.end(), [&](const TypeName& one) { return one.name == type; });
  if (known == kTypes.end()) fail("has dtype " + quotedWord(type) + "; want F64, F32, I64 or I32");
  const auto& offsets = description["data_offsets"];
  Tensor tensor{known->type, description["shape"].get<std::vector<std::int64_t>>(), offsets[0].get<std::size_t>(),
                offsets[1].get<std::size_t>()};
  if (tensor.begin > tensor.end || tensor.end > data_.size())
    fail("reaches from byte " + std::to_string(tensor.begin) + " to " + std::to_string(tensor.end) + " of " +
         std::to_string(data_.size()) + " bytes of data");
  const auto size = byteCount(tensor.type, tensor.shape);
  if (!size || static_cast<std::size_t>(*size) != tensor.end - tensor.begin)
    fail("has " + std::to_string(tensor.end - tensor.begin) + " bytes, which is not " + describe(tensor.shape) +
         " of " + type);
  if (reinterpret_cast<std::uintptr_t>(data_.data() + tensor.begin) % known->size != 0)
    fail("is not aligned to its numbers; write the file with a writer that aligns them");
  tensors_.emplace(name, std::move(tensor));
}

void TensorFile::requireSeamless() const {
  std::vector<std::pair<std::size_t, std::size_t>> ranges;
  for (const auto& [name, tensor] : tensors_) ranges.emplace_back(tensor.begin, tensor.end);
  std::sort(ranges.begin(), ranges.end());
  std::size_t covered = 0;
  for (const auto& [begin, end] : ranges) {
    if (begin != covered)
      throw InvalidInput(file_, begin < covered ? "has tensors that overlap at byte " + std::to_string(begin)
                                                : "has a hole at byte " + std::to_string(covered) + " of its data");
    covered = end;
  }
  if (covered != data_.size())
    throw InvalidInput(file_, "has " + std::to_string(data_.size() - covered) + " bytes that belong to no tensor");
}

void TensorFile::readThrough(const std::function<void(std::string_view)>& sink) const {
  const auto advise = [&](std::size_t begin, std::size_t size, int advice) {
    const auto piece = begin < mapping_.size() ? mapping_.substr(begin, size) : std::string_view();
    return piece.empty() || ::madvise(const_cast<char*>(piece.data()), piece.size(), advice) == 0;
  };
  advise(0, kAhead, MADV_WILLNEED);
  for (std::size_t begin = 0; begin < mapping_.size(); begin += kPiece) {
    advise(begin + kAhead, kPiece, MADV_WILLNEED);
    // Maps the pages of the piece at once; that a disk fails or the file was cut is an error here, not a signal.
    // Kernels before 5.14 do not know it and map page by page.
    if (!advise(begin, kPiece, kPopulateRead) && errno == EFAULT)
      throw InvalidInput(file_, "cannot be read from the disk at byte " + std::to_string(begin));
    sink(mapping_.substr(begin, kPiece));
  }
}

std::vector<std::string> TensorFile::names() const {
  std::vector<std::string> list;
  for (const auto& [name, tensor] : tensors_) list.push_back(name);
  return list;
}

const TensorFile::Tensor& TensorFile::find(std::string_view name) const {
  const auto found = tensors_.find(name);
  if (found == tensors_.end()) throw InvalidInput(file_, "has no tensor " + quotedWord(name));
  return found->second;
}

std::string_view TensorFile::bytesOf(std::string_view name, TensorType type) const {
  const auto& tensor = find(name);
  if (tensor.type != type)
    throw InvalidInput(
        file_, "tensor " + quotedWord(name) + " holds " + nameOf(tensor.type).name + ", want " + nameOf(type).name);
  return data_.substr(tensor.begin, tensor.end - tensor.begin);
}

void TensorFile::requireShape(std::string_view name, std::initializer_list<std::int64_t> shape) const {
  const auto& there = find(name).shape;
  const auto same = [](std::int64_t wanted, std::int64_t actual) { return wanted < 0 || wanted == actual; };
  if (!std::equal(shape.begin(), shape.end(), there.begin(), there.end(), same))
    throw InvalidInput(file_, "tensor " + quotedWord(name) + " is " + describe(there) + ", want " +
                                  describe({shape.begin(), shape.size()}));
}

template <class Number>
void TensorWriter::addNumbers(const std::string& name, const std::vector<std::int64_t>& shape,
                              std::span<const Number> values) {
  const bool printable = std::all_of(name.begin(), name.end(), [](char c) { return c > ' ' && c <= '~'; });
  if (name.empty() || !printable || name == kMetadata)
    throw InvalidInput("tensors", "no tensor can be called " + quotedWord(name));
  for (const auto& tensor : tensors_)
    if (tensor.name == name) throw InvalidInput("tensors", "two are called " + quotedWord(name));
  const auto size = byteCount(tensorTypeOf<Number>(), shape);
  if (!size || static_cast<std::size_t>(*size) != values.size_bytes())
    throw InvalidInput("tensors", quotedWord(name) + " has " + std::to_string(values.size()) +
                                      " numbers, which is not " + describe(shape));
  tensors_.push_back(
      {name, tensorTypeOf<Number>(), shape, {reinterpret_cast<const char*>(values.data()), values.size_bytes()}});
}

void TensorWriter::add(const std::string& name, const std::vector<std::int64_t>& shape,
                       std::span<const double> values) {
  addNumbers(name, shape, values);
}

void TensorWriter::add(const std::string& name, const std::vector<std::int64_t>& shape, std::span<const float> values) {
  addNumbers(name, shape, values);
}

void TensorWriter::add(const std::string& name, const std::vector<std::int64_t>& shape,
                       std::span<const std::int64_t> values) {
  addNumbers(name, shape, values);
}

void TensorWriter::add(const std::string& name, const std::vector<std::int64_t>& shape,
                       std::span<const std::int32_t> values) {
  addNumbers(name, shape, values);
}

void TensorWriter::write(const std::function<void(std::string_view)>& sink) const {
  std::vector<const Tensor*> ordered;
  for (const auto& tensor : tensors_) ordered.push_back(&tensor);
  // Eight-byte numbers first: then all are aligned, as the header ends at a multiple of eight.
  std::stable_sort(ordered.begin(), ordered.end(),
                   [](const Tensor* a, const Tensor* b) { return nameOf(a->type).size > nameOf(b->type).size; });
  json header = json::object();
  if (!metadata_.empty()) header[kMetadata] = metadata_;
  std::size_t end = 0;
  for (const auto* tensor : ordered) {
    const auto begin = end;
    end += tensor->bytes.size();
    header[tensor->name] = {
        {"dtype", nameOf(tensor->type).name}, {"shape", tensor->shape}, {"data_offsets", {begin, end}}};
  }
  auto text = header.dump();
  text.resize((text.size() + 7) / 8 * 8, ' ');
  std::string length;
  appendNumber(length, static_cast<std::uint64_t>(text.size()), std::endian::little);
  sink(length);
  sink(text);
  for (const auto* tensor : ordered) sink(tensor->bytes);
}

void TensorWriter::write(const std::filesystem::path& path) const {
  FileWriter writer(path);
  write([&](std::string_view bytes) { writer.write(bytes); });
  writer.commit();
}

}  // namespace shaped
