#pragma once

#include <string>
#include <vector>

namespace shaped {

/// One line of a plot. A value that is not finite breaks the line there.
struct PlotSeries {
  std::string name;  ///< for the legend; empty: not listed
  std::vector<double> x, y;
};

/// A line plot with linear axes.
struct LinePlot {
  std::string title, x_label, y_label;
  std::vector<PlotSeries> series;
  bool y_from_zero = true;        ///< the y axis includes 0: what errors and shares want
  int width = 720, height = 440;  ///< pixels, 200 to 4000
};

/// The plot as an SVG document: round ticks, a light grid, a marker at every point, a legend where a series has a name.
/// Throws InvalidInput naming the series when there is none, x and y differ in length or no point is finite, and for a
/// size out of range.
std::string svgPlot(const LinePlot& plot);

/// Round numbers (steps of 1, 2 or 5 times a power of ten) from at or below low to at or above high, about `count`.
std::vector<double> roundTicks(double low, double high, int count = 6);

}  // namespace shaped
