#include "core/io/c3d_parameters.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>

#include "core/io/byte_reader.h"
#include "core/io/text_scanner.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

std::string upperCase(std::string_view name) {
  std::string upper(name);
  for (char& c : upper) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return upper;
}

std::string trimmed(std::string_view text) {
  constexpr std::string_view blanks(" \t\r\n\0", 5);
  const auto begin = text.find_first_not_of(blanks);
  if (begin == std::string_view::npos) return {};
  return std::string(text.substr(begin, text.find_last_not_of(blanks) + 1 - begin));
}

}  // namespace

C3dParameters::C3dParameters(const std::string& file, std::string_view bytes, std::size_t begin, std::size_t end,
                             C3dNumbers numbers)
    : numbers_(numbers) {
  // An item: length of the name (negative: locked), group number (negative: this is the group), name, and the distance
  // from that distance to the next item; a name of length 0 or a distance of 0 ends the list.
  for (std::size_t at = begin; at < end;) {
    ByteReader item(file, bytes.substr(std::min(at, bytes.size())));
    const int name_length = std::abs(int{item.number<std::int8_t>(std::endian::little)});
    if (name_length == 0) return;
    const int id = item.number<std::int8_t>(std::endian::little);
    const auto name = upperCase(trimmed(item.take(static_cast<std::size_t>(name_length))));
    const auto distance_at = at + item.position();
    const std::size_t distance = numbers_.word(item.take(2).data());
    if (id < 0)
      groups_.emplace(name, -id);
    else
      addParameter(file, bytes.substr(at + item.position()), id, name);
    if (distance == 0) return;
    at = distance_at + std::max<std::size_t>(distance, 2);
  }
}

void C3dParameters::addParameter(const std::string& file, std::string_view content, int group, std::string name) {
  ByteReader reader(file, content);
  Parameter parameter{reader.number<std::int8_t>(std::endian::little), {}, {}};
  const int dimensions = reader.number<std::uint8_t>(std::endian::little);
  std::size_t count = 1;
  for (int d = 0; d < dimensions; ++d) {
    parameter.extents.push_back(reader.number<std::uint8_t>(std::endian::little));
    count *= parameter.extents.back();
    if (count > content.size())
      throw InvalidInput(file, "has the parameter " + quotedWord(name) + " that is larger than the file");
  }
  const auto size = static_cast<std::size_t>(std::abs(parameter.type));
  if (size != 1 && size != 2 && size != 4) return;  // a type that we do not know, and do not need
  parameter.data = reader.take(count * size);
  parameters_.emplace(std::pair(group, std::move(name)), std::move(parameter));
}

const C3dParameters::Parameter* C3dParameters::find(std::string_view group, std::string_view name) const {
  const auto known = groups_.find(group);
  if (known == groups_.end()) return nullptr;
  const auto found = parameters_.find(std::pair(known->second, std::string(name)));
  return found == parameters_.end() ? nullptr : &found->second;
}

std::vector<std::string> C3dParameters::texts(std::string_view group, std::string_view name, std::size_t most) const {
  const auto* parameter = find(group, name);
  if (!parameter || parameter->type != -1) return {};
  const auto length = parameter->extents.empty() ? 1 : parameter->extents.front();
  std::vector<std::string> entries;
  for (std::size_t at = 0; length > 0 && entries.size() < most && at + length <= parameter->data.size(); at += length)
    entries.push_back(trimmed(parameter->data.substr(at, length)));
  return entries;
}

std::optional<double> C3dParameters::number(std::string_view group, std::string_view name, std::size_t index) const {
  const auto* parameter = find(group, name);
  if (!parameter || parameter->type < 1) return std::nullopt;
  const auto size = static_cast<std::size_t>(parameter->type);
  if ((index + 1) * size > parameter->data.size()) return std::nullopt;
  const char* at = parameter->data.data() + index * size;
  if (size == 1) return loadNumber<std::uint8_t>(at, std::endian::little);
  return size == 2 ? numbers_.word(at) : numbers_.real(at);
}

std::optional<std::int64_t> C3dParameters::count(std::string_view group, std::string_view name,
                                                 std::size_t index) const {
  const auto value = number(group, name, index);
  if (!value || !(std::abs(*value) < 1e12)) return std::nullopt;
  return std::llround(*value);
}

}  // namespace shaped
