#include "client/shapectl/curve_output.h"

#include <algorithm>
#include <cmath>
#include <iostream>

#include "client/shapectl/numbers.h"
#include "core/rendering/svg_plot.h"

namespace shaped::shapectl {
namespace {

double largest(const google::protobuf::RepeatedField<double>& values) {
  return values.empty() ? 0 : *std::max_element(values.begin(), values.end());
}

}  // namespace

std::uint32_t wholeOf(const std::string& option, double value) {
  if (!(value >= 0) || value > 1e9 || value != std::floor(value))
    throw InvalidInput(option, "= " + std::to_string(value) + ", want a whole number of 0 or more");
  return static_cast<std::uint32_t>(value);
}

void FlowFlags::declare(Arguments& arguments, const std::string& default_steps) {
  arguments.option("--steps", steps, "N", "Steps of the smoothing flow (" + default_steps + ")");
  arguments.option("--tau", tau, "X", "Longest step, above 0, at most 1 (0.5)");
  arguments.flag("--fixed-tau", fixed_tau, "Take every step in full, also where the path energy does not fall");
  arguments.flag("--keep-speed", keep_speed, "Keep the ratios of the frames' distances instead of evening them out");
  arguments.option("--reduced", reduced, "MODE", "auto, on or off: in a space of a few dimensions (auto)");
  arguments.option("--dimension", dimension, "D", "Its dimensions (15)");
  arguments.option("--ghost-vertices", ghost_vertices, "N", "Vertices of the mesh that energies are taken of (1250)");
}

void FlowFlags::fill(v1::FlowOptions& options) const {
  if (steps) options.set_steps(wholeOf("--steps", *steps));
  if (tau) options.set_tau(*tau);
  options.set_fixed_tau(fixed_tau);
  options.set_keep_speed(keep_speed);
  if (reduced != "auto" && reduced != "on" && reduced != "off")
    throw InvalidInput("--reduced", "is \"" + reduced + "\", want auto, on or off");
  options.set_reduction(reduced == "on"    ? v1::CURVE_REDUCTION_ON
                        : reduced == "off" ? v1::CURVE_REDUCTION_OFF
                                           : v1::CURVE_REDUCTION_AUTO);
  options.set_dimension(countOf("--dimension", dimension));
  options.set_ghost_vertices(countOf("--ghost-vertices", ghost_vertices));
}

void GeodesicFlags::declare(Arguments& arguments) {
  arguments.option("--enrichments", enrichments, "N", "How often the space of shapes grows at most (2)");
  arguments.option("--geodesic-dimension", dimension, "D", "Its dimensions to begin with (14)");
  arguments.option("--geodesic-ghost-vertices", ghost_vertices, "N",
                   "Vertices of the mesh that energies are taken of (1250)");
  arguments.option("--tolerance", tolerance, "T", "Of the solver: root of the relative gain that is left (1e-4)");
  arguments.flag("--by-flow", by_flow, "By the smoothing flow instead of Newton's method");
}

void GeodesicFlags::fill(v1::GeodesicOptions& options) const {
  if (enrichments) options.set_enrichments(wholeOf("--enrichments", *enrichments));
  options.set_dimension(countOf("--geodesic-dimension", dimension));
  options.set_ghost_vertices(countOf("--geodesic-ghost-vertices", ghost_vertices));
  options.set_tolerance(tolerance);
  options.set_by_flow(by_flow);
}

void printSmoothing(const v1::SmoothSummary& summary, nlohmann::json more, const std::string& out,
                    const Session& session) {
  if (session.json) {
    nlohmann::json& document = more;
    addReport(document, summary.report());
    document["file"] = out;
    document["frames"] = summary.gradient_before_size();
    document["steps"] = summary.steps();
    document["stationary"] = summary.stationary();
    document["windows"] = summary.windows();
    document["dimension"] = summary.dimension();
    document["path_energy_before"] = summary.path_energy_before();
    document["path_energy_after"] = summary.path_energy_after();
    document["step_energies"] = summary.step_energies();
    document["gradient_before"] = summary.gradient_before();
    document["gradient_after"] = summary.gradient_after();
    document["smallest_area_ratio"] = summary.smallest_area_ratio();
    document["bending"] = summary.bending();
    return printJson(document);
  }
  std::cout << out << ": " << summary.gradient_before_size() << " frames, " << summary.steps() << " steps"
            << (summary.stationary() ? " (nothing left to smooth)" : "") << ", " << reportText(summary.report())
            << "\npath energy " << summary.path_energy_before() << " -> " << summary.path_energy_after()
            << " m^2, sharpest corner " << largest(summary.gradient_before()) << " -> "
            << largest(summary.gradient_after()) << " m, smallest area ratio " << summary.smallest_area_ratio() << "\n";
}

void printGeodesic(const v1::GeodesicSummary& summary, const std::string& out, const Session& session) {
  if (session.json) {
    nlohmann::json document{{"file", out},
                            {"path_energy", summary.path_energy()},
                            {"dimension", summary.dimension()},
                            {"missing", summary.missing()},
                            {"geodesics", summary.geodesics()},
                            {"smallest_area_ratio", summary.smallest_area_ratio()},
                            {"bending", summary.bending()}};
    addReport(document, summary.report());
    return printJson(document);
  }
  std::cout << out << ": " << reportText(summary.report()) << "\npath energy " << summary.path_energy()
            << " m^2 in a space of " << summary.dimension() << " dimensions, which misses about "
            << summary.missing() * 100 << " % of the shapes' size; smallest area ratio "
            << summary.smallest_area_ratio() << "\n";
}

std::string gradientPlot(const v1::SmoothSummary& summary, const std::string& title) {
  const auto series = [](const char* label, const google::protobuf::RepeatedField<double>& values) {
    PlotSeries line{label, {}, {}};
    for (int i = 0; i < values.size(); ++i) {
      line.x.push_back(i);
      line.y.push_back(values[i]);
    }
    return line;
  };
  return svgPlot({.title = title,
                  .x_label = "frame",
                  .y_label = "norm of the path energy's gradient [m]",
                  .series = {series("before", summary.gradient_before()), series("after", summary.gradient_after())}});
}

std::string energyPlot(const v1::SmoothSummary& summary, const std::string& title) {
  if (summary.step_energies().empty())
    throw InvalidInput("--plot-energy", "is for clips that one window sees, this one took " +
                                            std::to_string(summary.windows()) + " (--window makes it larger)");
  if (!(largest(summary.step_energies()) > 0))
    throw InvalidInput("--plot-energy", "has nothing to draw: the clip does not move");
  PlotSeries energies{"", {}, {}};
  for (int k = 0; k < summary.step_energies_size(); ++k) {
    energies.x.push_back(k);
    energies.y.push_back(summary.step_energies(k));
  }
  LinePlot plot{.title = title, .x_label = "steps", .y_label = "path energy [m^2]", .series = {std::move(energies)}};
  plot.y_logarithmic = true;
  return svgPlot(plot);
}

}  // namespace shaped::shapectl
