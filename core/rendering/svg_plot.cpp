#include "core/rendering/svg_plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "core/numerics/error.h"

namespace shaped {
namespace {

/// Okabe and Ito's colours, told apart with every kind of colour vision; black and yellow left out.
constexpr std::array<const char*, 6> kColors{"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00"};
constexpr double kLeft = 74, kRight = 24, kBottom = 58, kLegendRow = 20;

const char* color(std::size_t series) { return kColors[series % kColors.size()]; }

template <class... Values>
std::string format(const char* pattern, Values... values) {
  const int length = std::snprintf(nullptr, 0, pattern, values...);
  std::string text(static_cast<std::size_t>(length), '\0');
  std::snprintf(text.data(), text.size() + 1, pattern, values...);
  return text;
}

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '&')
      result += "&amp;";
    else if (c == '<')
      result += "&lt;";
    else if (c == '>')
      result += "&gt;";
    else if (c == '"')
      result += "&quot;";
    else if (static_cast<unsigned char>(c) >= 32)
      result += c;
  }
  return result;
}

std::string textElement(double x, double y, const std::string& text, const char* attributes) {
  return format("<text x=\"%.1f\" y=\"%.1f\" %s>", x, y, attributes) + escaped(text) + "</text>\n";
}

/// One axis: data values onto pixels.
struct Axis {
  std::vector<double> ticks;
  double pixel_low, pixel_high;
  bool logarithmic = false;

  double pixel(double value) const {
    const double low = scaled(ticks.front()), high = scaled(ticks.back());
    return pixel_low + (scaled(value) - low) / (high - low) * (pixel_high - pixel_low);
  }

  /// Powers of ten beyond four digits in short: the axis' name stands beside them.
  std::string label(double tick) const {
    const int power = logarithmic ? static_cast<int>(std::lround(std::log10(tick))) : 0;
    return std::abs(power) < 4 ? format("%.6g", tick) : format("1e%d", power);
  }

 private:
  double scaled(double value) const { return logarithmic ? std::log10(value) : value; }
};

struct Frame {
  Axis x, y;
};

bool drawable(const LinePlot& plot, const PlotSeries& series, std::size_t i) {
  return std::isfinite(series.x[i]) && std::isfinite(series.y[i]) && (!plot.y_logarithmic || series.y[i] > 0);
}

void requirePlot(const LinePlot& plot) {
  if (plot.series.empty()) throw InvalidInput("series", "a plot needs at least one");
  if (std::min(plot.width, plot.height) < 200 || std::max(plot.width, plot.height) > 4000)
    throw InvalidInput("width, height", "want 200 to 4000 pixels");
  for (std::size_t s = 0; s < plot.series.size(); ++s) {
    const auto& series = plot.series[s];
    const std::string field = "series[" + std::to_string(s) + "]";
    if (series.x.size() != series.y.size())
      throw InvalidInput(field, "has " + std::to_string(series.x.size()) + " x and " + std::to_string(series.y.size()) +
                                    " y values, want as many");
    bool any = false;
    for (std::size_t i = 0; i < series.x.size(); ++i) any = any || drawable(plot, series, i);
    if (!any)
      throw InvalidInput(field, std::string("has no point with ") + (plot.y_logarithmic ? "positive y and " : "") +
                                    "finite coordinates");
  }
}

std::size_t namedCount(const LinePlot& plot) {
  return static_cast<std::size_t>(
      std::count_if(plot.series.begin(), plot.series.end(), [](const PlotSeries& s) { return !s.name.empty(); }));
}

Frame frameOf(const LinePlot& plot) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  double x_low = infinity, x_high = -infinity, y_low = infinity, y_high = -infinity;
  for (const auto& series : plot.series)
    for (std::size_t i = 0; i < series.x.size(); ++i) {
      if (!drawable(plot, series, i)) continue;
      x_low = std::min(x_low, series.x[i]), x_high = std::max(x_high, series.x[i]);
      y_low = std::min(y_low, series.y[i]), y_high = std::max(y_high, series.y[i]);
    }
  if (plot.y_from_zero && !plot.y_logarithmic) y_low = std::min(y_low, 0.0), y_high = std::max(y_high, 0.0);
  const double top = (plot.title.empty() ? 20 : 44) + (namedCount(plot) > 1 ? kLegendRow + 6 : 0);
  return {{roundTicks(x_low, x_high, 8), kLeft, plot.width - kRight},
          {plot.y_logarithmic ? decadeTicks(y_low, y_high) : roundTicks(y_low, y_high), plot.height - kBottom, top,
           plot.y_logarithmic}};
}

std::string axes(const LinePlot& plot, const Frame& frame) {
  std::string svg;
  const auto& [x, y] = frame;
  for (const double tick : y.ticks) {
    svg += format("<line x1=\"%.1f\" x2=\"%.1f\" y1=\"%.1f\" y2=\"%.1f\" stroke=\"#e3e6ea\"/>\n", x.pixel_low,
                  x.pixel_high, y.pixel(tick), y.pixel(tick));
    svg += textElement(x.pixel_low - 9, y.pixel(tick) + 4.5, y.label(tick), "text-anchor=\"end\"");
  }
  for (const double tick : x.ticks) {
    svg += format("<line x1=\"%.1f\" x2=\"%.1f\" y1=\"%.1f\" y2=\"%.1f\" stroke=\"#8a9099\"/>\n", x.pixel(tick),
                  x.pixel(tick), y.pixel_low, y.pixel_low + 5);
    svg += textElement(x.pixel(tick), y.pixel_low + 20, format("%.6g", tick), "text-anchor=\"middle\"");
  }
  svg += format("<line x1=\"%.1f\" x2=\"%.1f\" y1=\"%.1f\" y2=\"%.1f\" stroke=\"#8a9099\"/>\n", x.pixel_low,
                x.pixel_high, y.pixel_low, y.pixel_low);
  svg += textElement(0.5 * (x.pixel_low + x.pixel_high), plot.height - 14, plot.x_label, "text-anchor=\"middle\"");
  const double middle = 0.5 * (y.pixel_low + y.pixel_high);
  svg += textElement(18, middle, plot.y_label,
                     format("text-anchor=\"middle\" transform=\"rotate(-90 18 %.1f)\"", middle).c_str());
  if (!plot.title.empty())
    svg += textElement(x.pixel_low, 28, plot.title, "font-size=\"17\" font-weight=\"600\" fill=\"#1f2328\"");
  return svg;
}

std::string line(const LinePlot& plot, const PlotSeries& series, const Frame& frame, const char* stroke) {
  std::string path, dots;
  bool drawing = false;
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    const bool drawn = drawable(plot, series, i);
    if (drawn) {
      const double x = frame.x.pixel(series.x[i]), y = frame.y.pixel(series.y[i]);
      path += format("%s%.2f,%.2f ", drawing ? "L" : "M", x, y);
      if (series.x.size() <= 60)
        dots += format("<circle cx=\"%.2f\" cy=\"%.2f\" r=\"3.2\" fill=\"%s\"/>\n", x, y, stroke);
    }
    drawing = drawn;
  }
  return format("<path d=\"%s\" fill=\"none\" stroke=\"%s\" stroke-width=\"2\" stroke-linejoin=\"round\"/>\n",
                path.c_str(), stroke) +
         dots;
}

/// The names in one row above the plot; a single series needs none, its axis says it all.
std::string legend(const LinePlot& plot, const Frame& frame) {
  if (namedCount(plot) < 2) return {};
  std::string svg;
  double x = frame.x.pixel_low;
  const double y = frame.y.pixel_high - kLegendRow;
  for (std::size_t s = 0; s < plot.series.size(); ++s) {
    const auto& name = plot.series[s].name;
    if (name.empty()) continue;
    svg += format("<line x1=\"%.1f\" x2=\"%.1f\" y1=\"%.1f\" y2=\"%.1f\" stroke=\"%s\" stroke-width=\"3\"/>\n", x,
                  x + 20, y, y, color(s));
    svg += textElement(x + 26, y + 4.5, name, "");
    x += 26 + 7.4 * static_cast<double>(name.size()) + 22;
  }
  return svg;
}

}  // namespace

std::vector<double> roundTicks(double low, double high, int count) {
  if (!(high > low)) {
    const double half = low == 0 ? 1 : 0.5 * std::abs(low);
    low -= half, high += half;
  }
  const double raw = (high - low) / std::max(count - 1, 1), decade = std::pow(10.0, std::floor(std::log10(raw)));
  double step = 10 * decade;
  for (const double factor : {5.0, 2.0, 1.0})
    if (raw <= factor * decade * (1 + 1e-9)) step = factor * decade;
  const double first = std::floor(low / step + 1e-9), last = std::ceil(high / step - 1e-9);
  std::vector<double> ticks;
  for (double i = first; i <= last; ++i) ticks.push_back(i * step + 0.0);  // + 0.0 turns -0 into 0
  return ticks;
}

std::vector<double> decadeTicks(double low, double high, int count) {
  const int first = static_cast<int>(std::floor(std::log10(low) + 1e-9));
  const int last = std::max(static_cast<int>(std::ceil(std::log10(high) - 1e-9)), first + 1);
  const int step = (last - first + count - 1) / count;
  std::vector<double> ticks;
  for (int power = first; power < last + step; power += step) ticks.push_back(std::pow(10.0, power));
  return ticks;
}

std::string svgPlot(const LinePlot& plot) {
  requirePlot(plot);
  const Frame frame = frameOf(plot);
  std::string svg = format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"%d\" viewBox=\"0 0 %d %d\" "
      "font-family=\"Helvetica, Arial, sans-serif\" font-size=\"13\" fill=\"#4a5058\">\n"
      "<rect width=\"100%%\" height=\"100%%\" fill=\"white\"/>\n",
      plot.width, plot.height, plot.width, plot.height);
  svg += axes(plot, frame);
  for (std::size_t s = 0; s < plot.series.size(); ++s) svg += line(plot, plot.series[s], frame, color(s));
  return svg + legend(plot, frame) + "</svg>\n";
}

}  // namespace shaped
