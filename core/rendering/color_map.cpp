#include "core/rendering/color_map.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/numerics/error.h"

namespace shaped {

Color errorColor(double fraction) {
  static const std::array<Color, 6> anchors{Color(0.90f, 0.92f, 0.93f), Color(0.98f, 0.86f, 0.50f),
                                            Color(0.96f, 0.63f, 0.27f), Color(0.85f, 0.35f, 0.25f),
                                            Color(0.58f, 0.14f, 0.36f), Color(0.24f, 0.06f, 0.34f)};
  if (std::isnan(fraction)) return Color::Constant(0.5f);
  const double place = std::clamp(fraction, 0.0, 1.0) * static_cast<double>(anchors.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(place), anchors.size() - 2);
  const auto t = static_cast<float>(place - static_cast<double>(below));
  return (1 - t) * anchors[below] + t * anchors[below + 1];
}

Vertices errorColors(const Eigen::VectorXd& values, double limit) {
  if (!(limit > 0)) throw InvalidInput("limit", "is " + std::to_string(limit) + ", want a positive value");
  Vertices colors(values.size(), 3);
  for (Eigen::Index v = 0; v < values.size(); ++v)
    colors.row(v) = errorColor(values[v] / limit).cast<double>().transpose();
  return colors;
}

double roundedLimit(double value) {
  if (!(value > 0) || !std::isfinite(value)) return 1;
  const double decade = std::pow(10.0, std::floor(std::log10(value)));
  for (const double step : {1.0, 2.0, 5.0})
    if (value <= step * decade * (1 + 1e-12)) return step * decade;
  return 10 * decade;
}

}  // namespace shaped
