#include "core/io/length_unit.h"

#include <array>
#include <cctype>
#include <string>

namespace shaped {
namespace {

struct Unit {
  std::string_view name;
  double metres;
};

constexpr std::array kUnits{
    Unit{"mm", 1e-3},         Unit{"millimeter", 1e-3}, Unit{"millimetre", 1e-3}, Unit{"cm", 1e-2},
    Unit{"centimeter", 1e-2}, Unit{"centimetre", 1e-2}, Unit{"dm", 1e-1},         Unit{"m", 1},
    Unit{"meter", 1},         Unit{"metre", 1},         Unit{"in", 0.0254},       Unit{"inch", 0.0254},
    Unit{"inche", 0.0254},    Unit{"ft", 0.3048},       Unit{"foot", 0.3048},     Unit{"feet", 0.3048}};

}  // namespace

std::optional<double> metresPer(std::string_view unit) {
  std::string name;
  for (const char c : unit) name += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const auto& known : kUnits)
    if (name == known.name || name == std::string(known.name) + "s") return known.metres;
  return std::nullopt;
}

}  // namespace shaped
