#include "core/io/c3d_numbers.h"

#include <cmath>
#include <limits>

#include "core/io/byte_reader.h"

namespace shaped {
namespace {

double vaxReal(std::uint32_t first_word, std::uint32_t second_word) {
  const int exponent = static_cast<int>((first_word >> 7) & 255);
  const bool negative = (first_word & 0x8000) != 0;
  if (exponent == 0) return negative ? std::numeric_limits<double>::quiet_NaN() : 0;
  const double fraction = ((first_word & 127) << 16 | second_word) + 8388608.0;  // the hidden bit, 2^23
  return std::ldexp(negative ? -fraction : fraction, exponent - 128 - 24);
}

}  // namespace

std::uint16_t C3dNumbers::word(const char* bytes) const {
  return loadNumber<std::uint16_t>(bytes, processor_ == C3dProcessor::kMips ? std::endian::big : std::endian::little);
}

double C3dNumbers::real(const char* bytes) const {
  switch (processor_) {
    case C3dProcessor::kIntel:
      return loadNumber<float>(bytes, std::endian::little);
    case C3dProcessor::kMips:
      return loadNumber<float>(bytes, std::endian::big);
    case C3dProcessor::kDec:
      return vaxReal(word(bytes), word(bytes + 2));
  }
  return 0;
}

}  // namespace shaped
