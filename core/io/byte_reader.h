#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

#include "core/numerics/error.h"

namespace shaped {

/// The bytes of a number in reverse order.
template <class Number>
Number swapBytes(Number value) {
  char bytes[sizeof(Number)], reversed[sizeof(Number)];
  std::memcpy(bytes, &value, sizeof(Number));
  for (std::size_t i = 0; i < sizeof(Number); ++i) reversed[i] = bytes[sizeof(Number) - 1 - i];
  std::memcpy(&value, reversed, sizeof(Number));
  return value;
}

/// A number from (unaligned) bytes in the given byte order. bytes must hold sizeof(Number).
template <class Number>
Number loadNumber(const char* bytes, std::endian order) {
  static_assert(std::is_arithmetic_v<Number>);
  Number value;
  std::memcpy(&value, bytes, sizeof(Number));
  return order == std::endian::native ? value : swapBytes(value);
}

/// Walks bytes with every step checked against their end; running over it throws InvalidInput naming the file.
class ByteReader {
 public:
  ByteReader(std::string file, std::string_view bytes) : file_(std::move(file)), bytes_(bytes) {}

  std::size_t position() const { return position_; }
  std::size_t remaining() const { return bytes_.size() - position_; }

  std::string_view take(std::size_t count) {
    if (count > remaining())
      throw InvalidInput(file_, "is truncated: " + std::to_string(count) + " bytes wanted at byte " +
                                    std::to_string(position_) + ", " + std::to_string(remaining()) + " there");
    const auto taken = bytes_.substr(position_, count);
    position_ += count;
    return taken;
  }

  template <class Number>
  Number number(std::endian order) {
    return loadNumber<Number>(take(sizeof(Number)).data(), order);
  }

 private:
  std::string file_;
  std::string_view bytes_;
  std::size_t position_ = 0;
};

/// Appends a number's bytes in the given order.
template <class Number>
void appendNumber(std::string& bytes, Number value, std::endian order) {
  if (order != std::endian::native) value = swapBytes(value);
  char raw[sizeof(Number)];
  std::memcpy(raw, &value, sizeof(Number));
  bytes.append(raw, sizeof(Number));
}

}  // namespace shaped
