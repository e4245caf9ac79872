#pragma once

#include <bit>
#include <cstdint>

namespace shaped {

/// The machine whose number formats a C3D file uses; the values are the codes in the file.
enum class C3dProcessor : std::uint8_t { kIntel = 84, kDec = 85, kMips = 86 };

/// Decodes the numbers of one processor. Pointers need no alignment.
class C3dNumbers {
 public:
  explicit C3dNumbers(C3dProcessor processor) : processor_(processor) {}

  std::uint16_t word(const char* bytes) const;
  std::int16_t signedWord(const char* bytes) const { return static_cast<std::int16_t>(word(bytes)); }
  /// IEEE single precision, or VAX F of DEC machines: sign, 8 bits of exponent with bias 128, fraction 0.1..., the two
  /// words swapped. A VAX reserved operand becomes NaN.
  double real(const char* bytes) const;

 private:
  C3dProcessor processor_;
};

}  // namespace shaped
