#include "core/io/text_scanner.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "core/numerics/error.h"

namespace shaped {
namespace {

constexpr std::string_view kBlanks = " \t\v\f";

template <class Number>
bool parseWhole(std::string_view word, Number& value) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);  // from_chars knows no plus
  const auto* end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(word.data(), end, value);
  return error == std::errc() && stop == end;
}

}  // namespace

std::string quotedWord(std::string_view word) {
  constexpr std::size_t longest = 40;
  std::string text = "'";
  for (const char c : word.substr(0, longest)) text += c >= ' ' && c <= '~' ? c : '?';
  return text + (word.size() > longest ? "...'" : "'");
}

std::string shortest(double value) {
  std::array<char, 32> buffer;
  const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return error == std::errc() ? std::string(buffer.data(), end) : "nan";
}

bool parseNumber(std::string_view word, double& value) {
  if (parseWhole(word, value)) return true;
  // Beyond the range of a double, from_chars gives up where a number is meant: too small is zero.
  double mantissa = 0;
  const auto exponent = word.find_first_of("eE");
  std::int64_t power = 0;
  if (exponent == std::string_view::npos || !parseWhole(word.substr(0, exponent), mantissa) ||
      !std::isfinite(mantissa) || !parseWhole(word.substr(exponent + 1), power) || power > 0)
    return false;
  value = 0;
  return true;
}

bool parseInteger(std::string_view word, std::int64_t& value) { return parseWhole(word, value); }

bool TextScanner::nextLine() {
  if (rest_.empty()) return false;
  ++line_number_;
  const auto end = rest_.find_first_of("\r\n");
  line_ = rest_.substr(0, end);
  if (end == std::string_view::npos) {
    rest_ = {};
  } else {
    const bool two = rest_[end] == '\r' && end + 1 < rest_.size() && rest_[end + 1] == '\n';
    rest_.remove_prefix(end + (two ? 2 : 1));
  }
  return true;
}

bool TextScanner::nextContentLine(char comment) {
  while (nextLine()) {
    line_ = line_.substr(0, line_.find(comment));
    if (line_.find_first_not_of(kBlanks) != std::string_view::npos) return true;
  }
  return false;
}

std::string_view TextScanner::word() {
  const auto begin = line_.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) {
    line_ = {};
    return {};
  }
  const auto end = std::min(line_.find_first_of(kBlanks, begin), line_.size());
  const auto found = line_.substr(begin, end - begin);
  line_.remove_prefix(end);
  return found;
}

std::vector<std::string_view> TextScanner::fields(char separator) {
  std::vector<std::string_view> found;
  // A blank that separates is no padding.
  const auto blank = [&](char c) { return c != separator && kBlanks.find(c) != std::string_view::npos; };
  for (bool more = true; more;) {
    const auto end = line_.find(separator);
    auto field = line_.substr(0, end);
    while (!field.empty() && blank(field.front())) field.remove_prefix(1);
    while (!field.empty() && blank(field.back())) field.remove_suffix(1);
    found.push_back(field);
    more = end != std::string_view::npos;
    line_.remove_prefix(more ? end + 1 : line_.size());
  }
  return found;
}

double TextScanner::numberIn(std::string_view field, std::string_view what) const {
  double value = 0;
  if (field.empty()) fail("nothing stands where " + std::string(what) + " should");
  if (!parseNumber(field, value)) fail(quotedWord(field) + " is not a number; want " + std::string(what));
  return value;
}

std::int64_t TextScanner::integerIn(std::string_view field, std::string_view what) const {
  std::int64_t value = 0;
  if (field.empty()) fail("nothing stands where " + std::string(what) + " should");
  if (!parseInteger(field, value)) fail(quotedWord(field) + " is not a whole number; want " + std::string(what));
  return value;
}

double TextScanner::number(std::string_view what) { return numberIn(word(), what); }

std::int64_t TextScanner::integer(std::string_view what) { return integerIn(word(), what); }

void TextScanner::fail(const std::string& problem) const {
  throw InvalidInput(file_ + ":" + std::to_string(line_number_), problem);
}

}  // namespace shaped
