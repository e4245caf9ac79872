#include "server/convert/curve.h"

#include <cmath>

#include "core/numerics/error.h"

namespace shaped::server {
namespace {

constexpr int kMostSteps = 10'000, kMostDimension = 500, kMostEnrichments = 50;
constexpr Eigen::Index kSmall =
    1000;  ///< vertices of a mesh that is smoothed at full resolution unless asked otherwise

bool reducedFromProto(v1::CurveReduction reduction, Eigen::Index vertices, const std::string& field) {
  switch (reduction) {
    case v1::CURVE_REDUCTION_UNSPECIFIED:
    case v1::CURVE_REDUCTION_AUTO:
      return vertices > kSmall;
    case v1::CURVE_REDUCTION_ON:
      return true;
    case v1::CURVE_REDUCTION_OFF:
      return false;
    default:
      throw InvalidInput(field, "= " + std::to_string(reduction) + " is none of CurveReduction");
  }
}

}  // namespace

int numberFromProto(std::uint32_t value, int otherwise, int least, int most, const std::string& field) {
  if (value == 0) return otherwise;
  if (value < static_cast<std::uint32_t>(least) || value > static_cast<std::uint32_t>(most))
    throw InvalidInput(
        field, "= " + std::to_string(value) + ", want " + std::to_string(least) + " to " + std::to_string(most));
  return static_cast<int>(value);
}

double bendingFromProto(double bending, double otherwise) {
  if (!(bending >= 0) || !std::isfinite(bending))
    throw InvalidInput("bending", "= " + std::to_string(bending) + ", want > 0 (m^2), or 0 for the default");
  return bending > 0 ? bending : otherwise;
}

SmoothingOptions smoothingFromProto(const v1::FlowOptions& message, Eigen::Index vertices, int steps,
                                    const std::string& field) {
  SmoothingOptions options;
  options.steps = message.has_steps() ? numberFromProto(message.steps(), 0, 0, kMostSteps, field + ".steps") : steps;
  if (message.has_tau()) options.flow.tau = message.tau();
  if (!(options.flow.tau > 0 && options.flow.tau <= 1))
    throw InvalidInput(field + ".tau", "= " + std::to_string(message.tau()) + ", want in (0, 1]");
  options.flow.control = !message.fixed_tau();
  options.flow.keep_speed = message.keep_speed();
  options.reduced = reducedFromProto(message.reduction(), vertices, field + ".reduction");
  auto& reduction = options.reduction;
  reduction.dimension =
      numberFromProto(message.dimension(), reduction.dimension, 1, kMostDimension, field + ".dimension");
  reduction.ghost_vertices = numberFromProto(message.ghost_vertices(), reduction.ghost_vertices, 4,
                                             std::numeric_limits<int>::max(), field + ".ghost_vertices");
  return options;
}

GeodesicFlowOptions geodesicFromProto(const v1::GeodesicOptions& message, const std::string& field) {
  GeodesicFlowOptions options;
  options.dimension = numberFromProto(message.dimension(), options.dimension, 1, kMostDimension, field + ".dimension");
  options.ghost_vertices = numberFromProto(message.ghost_vertices(), options.ghost_vertices, 4,
                                           std::numeric_limits<int>::max(), field + ".ghost_vertices");
  if (message.has_enrichments())
    options.enrichments = numberFromProto(message.enrichments(), 0, 0, kMostEnrichments, field + ".enrichments");
  if (message.by_flow()) options.solver = PathSolver::kFlow;
  if (message.tolerance() != 0) options.tolerance = message.tolerance();
  if (!(options.tolerance > 0 && options.tolerance < 1))
    throw InvalidInput(field + ".tolerance", "= " + std::to_string(options.tolerance) + ", want in (0, 1)");
  return options;
}

std::vector<double> restoreFromProto(const google::protobuf::RepeatedField<double>& restore, std::int64_t frames) {
  for (int i = 0; i < restore.size(); ++i)
    if (!(restore[i] >= 0 && restore[i] <= 1))
      throw InvalidInput("restore[" + std::to_string(i) + "]", "= " + std::to_string(restore[i]) + ", want in [0, 1]");
  if (restore.size() == 1 && restore[0] == 0) return {};
  if (restore.size() == 1) return std::vector<double>(static_cast<std::size_t>(frames), restore[0]);
  if (!restore.empty() && restore.size() != frames)
    throw InvalidInput("restore", "has " + std::to_string(restore.size()) + " numbers, want one, or one for each of " +
                                      std::to_string(frames) + " frames");
  return {restore.begin(), restore.end()};
}

std::vector<bool> heldFromProto(const google::protobuf::RepeatedField<std::uint32_t>& held, std::int64_t frames) {
  if (held.empty()) return {};
  std::vector<bool> mask(static_cast<std::size_t>(frames), false);
  for (int i = 0; i < held.size(); ++i) {
    if (held[i] >= mask.size())
      throw InvalidInput("held[" + std::to_string(i) + "]", "= " + std::to_string(held[i]) + ", but there are " +
                                                                std::to_string(frames) + " frames, from 0");
    mask[held[i]] = true;
  }
  return mask;
}

std::optional<Eigen::Vector3d> upFromProto(const google::protobuf::RepeatedField<double>& up) {
  if (up.empty()) return std::nullopt;
  if (up.size() != 3) throw InvalidInput("up", "has " + std::to_string(up.size()) + " numbers, want three or none");
  const Eigen::Vector3d direction(up[0], up[1], up[2]);
  if (!direction.allFinite() || direction.norm() == 0) throw InvalidInput("up", "is no direction");
  return direction;
}

void requireCurveFits(std::int64_t frames, std::int64_t vertices, const Limits& limits, const std::string& field) {
  constexpr std::int64_t coordinates = 24;  // bytes of a vertex
  // Both are below 2^32, so neither product overflows.
  if (frames <= limits.curve_bytes / (coordinates * vertices)) return;
  constexpr std::int64_t mebi = 1 << 20;
  throw InvalidInput(field, std::to_string(frames) + " frames of " + std::to_string(vertices) + " vertices take " +
                                std::to_string(frames * vertices / mebi * coordinates) + " MiB, more than the " +
                                std::to_string(limits.curve_bytes / mebi) +
                                " MiB that the server holds at once "
                                "(--max-curve-megabytes); at most " +
                                std::to_string(limits.curve_bytes / (coordinates * vertices)) + " frames fit");
}

void toProto(const LongClipReport& report, v1::SmoothSummary& message) {
  message.set_steps(static_cast<std::uint32_t>(report.steps));
  message.set_stationary(report.stationary);
  message.set_windows(static_cast<std::uint32_t>(report.windows));
  message.set_dimension(static_cast<std::uint32_t>(report.dimension));
  message.set_smallest_area_ratio(report.smallest_area_ratio);
  message.set_path_energy_before(report.path_energy_before);
  message.set_path_energy_after(report.path_energy_after);
  message.mutable_step_energies()->Add(report.step_energies.begin(), report.step_energies.end());
  message.mutable_gradient_before()->Add(report.gradient_before.begin(), report.gradient_before.end());
  message.mutable_gradient_after()->Add(report.gradient_after.begin(), report.gradient_after.end());
}

void toProto(const JoinedClips& joined, v1::JoinSummary& message) {
  auto& smooth = *message.mutable_smooth();
  smooth.set_steps(static_cast<std::uint32_t>(joined.steps));
  smooth.set_stationary(joined.stationary);
  smooth.set_windows(static_cast<std::uint32_t>(joined.seams.size()));
  smooth.set_path_energy_before(joined.path_energy_before);
  smooth.set_path_energy_after(joined.path_energy_after);
  smooth.mutable_gradient_before()->Add(joined.gradient_before.begin(), joined.gradient_before.end());
  smooth.mutable_gradient_after()->Add(joined.gradient_after.begin(), joined.gradient_after.end());
  for (const auto& [before, after] : joined.seams) {
    auto& seam = *message.add_seams();
    seam.set_before(static_cast<std::uint32_t>(before));
    seam.set_after(static_cast<std::uint32_t>(after));
  }
}

}  // namespace shaped::server
