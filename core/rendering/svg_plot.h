#pragma once

#include <string>
#include <vector>

namespace shaped {

/// One line of a plot. A value that is not finite breaks the line there.
struct PlotSeries {
  std::string name;  ///< for the legend; empty: not listed
  std::vector<double> x, y;
};

/// A line plot; its x axis is linear.
struct LinePlot {
  std::string title, x_label, y_label;
  std::vector<PlotSeries> series;
  bool y_from_zero = true;        ///< a linear y axis includes 0: what errors and shares want
  bool y_logarithmic = false;     ///< powers of ten are equally far; values that are not positive break the line
  int width = 720, height = 440;  ///< pixels, 200 to 4000
};

/// The plot as an SVG document: round ticks, a light grid, a marker at every point, a legend where a series has a name.
/// Throws InvalidInput naming the series when there is none, x and y differ in length or no point can be drawn, and for
/// a size out of range.
std::string svgPlot(const LinePlot& plot);

/// Round numbers (steps of 1, 2 or 5 times a power of ten) from at or below low to at or above high, about `count`.
std::vector<double> roundTicks(double low, double high, int count = 6);

/// Powers of ten from at or below low to at or above high, two or more, each step of the same whole power, about
/// `count` at most. 0 < low <= high.
std::vector<double> decadeTicks(double low, double high, int count = 8);

}  // namespace shaped
