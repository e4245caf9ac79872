#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "client/shapectl/arguments.h"
#include "client/shapectl/output.h"
#include "client/shapectl/session.h"
#include "shaped/v1/curves.pb.h"

namespace shaped::shapectl {

/// The options of the smoothing flow that verbs share.
struct FlowFlags {
  std::optional<double> tau;
  std::optional<double> steps;
  std::string reduced = "auto";
  std::int64_t dimension = 0, ghost_vertices = 0;
  bool keep_speed = false, fixed_tau = false;

  void declare(Arguments& arguments, const std::string& default_steps);
  /// Throws InvalidInput naming the option.
  void fill(v1::FlowOptions& options) const;
};

/// The options of geodesics that verbs share.
struct GeodesicFlags {
  std::int64_t dimension = 0, ghost_vertices = 0;
  std::optional<double> enrichments;
  double tolerance = 0;
  bool by_flow = false;

  void declare(Arguments& arguments);
  void fill(v1::GeodesicOptions& options) const;
};

/// A whole number where 0 says something else than nothing. Throws InvalidInput naming the option.
std::uint32_t wholeOf(const std::string& option, double value);

/// What happened to a motion, as JSON or as text, with the file that holds it.
void printSmoothing(const v1::SmoothSummary& summary, nlohmann::json more, const std::string& out,
                    const Session& session);
void printGeodesic(const v1::GeodesicSummary& summary, const std::string& out, const Session& session);

/// The gradient's norm at each frame before and after, as SVG ([BvTH16] Fig. 7).
std::string gradientPlot(const v1::SmoothSummary& summary, const std::string& title);

/// The path energy after each step, as SVG with a logarithmic axis ([BvTH16] Fig. 9). Throws InvalidInput naming the
/// option when there is nothing to draw: several windows saw the clip, or it never moves.
std::string energyPlot(const v1::SmoothSummary& summary, const std::string& title);

}  // namespace shaped::shapectl
