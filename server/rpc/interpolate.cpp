#include "server/rpc/interpolate.h"

#include <cmath>

#include "core/geodesic/geodesic.h"
#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/shell/energy.h"
#include "server/convert/mesh.h"
#include "server/convert/report.h"
#include "server/errors/errors.h"

namespace shaped::server {
namespace {

constexpr double kFarthestTime = 10;

void check(const v1::InterpolateRequest& request, const Limits& limits) {
  requireAtMost(request.path_steps(), limits.path_steps, "path_steps", "steps");
  requireAtMost(request.times_size(), limits.times, "times", "times");
  for (int i = 0; i < request.times_size(); ++i)
    if (!(std::abs(request.times(i)) <= kFarthestTime))
      throw InvalidInput("times[" + std::to_string(i) + "]",
                         "= " + std::to_string(request.times(i)) + ", want -10 to 10");
  if (!(request.bending() >= 0) || !std::isfinite(request.bending()))
    throw InvalidInput("bending", "= " + std::to_string(request.bending()) + ", want > 0 (m^2), or 0 for the default");
}

void count(const Outcome& outcome, Call& call) {
  if (outcome.termination == Termination::kCancelled) throw Stopped();
  call.solved(outcome);
}

v1::InterpolateResponse summaryOf(const GeodesicCalculus& calculus, const Solved<Path>& path,
                                  const ReferenceAreas& areas, double seconds) {
  v1::InterpolateResponse response;
  auto& summary = *response.mutable_summary();
  toProto(path, seconds, *summary.mutable_report());
  double ratio = 1;
  for (const auto& shape : path.solution) ratio = std::min(ratio, areas.smallestRatio(shape));
  summary.set_smallest_area_ratio(ratio);
  summary.set_path_energy(calculus.pathEnergy(path.solution));
  for (const double energy : calculus.segmentEnergies(path.solution)) summary.add_segment_energies(energy);
  summary.set_bending(calculus.bending());
  return response;
}

}  // namespace

void interpolate(const Limits& limits, const v1::InterpolateRequest& request,
                 const std::function<void(v1::InterpolateResponse&&)>& write, Call& call) {
  check(request, limits);
  const auto from = meshFromProto(request.from(), limits, "from");
  const auto to = shapeFromProto(request.to(), *from.topology, "to");
  const double bending = request.bending() > 0 ? request.bending() : defaultBending(from.vertices);
  const int steps = request.path_steps() > 0 ? static_cast<int>(request.path_steps()) : 4;
  const GeodesicCalculus calculus(std::make_shared<const ShellStructure>(from.topology), bending);
  GeodesicOptions options;
  options.stop = call.stopToken();

  const auto path = calculus.interpolate(from.vertices, to, steps, options);
  count(path, call);
  const ReferenceAreas areas(from.topology->faces(), from.vertices);
  write(summaryOf(calculus, path, areas, call.workSeconds()));
  for (int i = 0; i < request.times_size(); ++i) {
    const double begin = call.workSeconds();
    const auto shape = calculus.at(path.solution, request.times(i), options);
    count(shape, call);
    v1::InterpolateResponse response;
    auto& frame = *response.mutable_frame();
    frame.set_index(static_cast<std::uint32_t>(i));
    frame.set_time(request.times(i));
    toProto(shape.solution, *from.topology, *frame.mutable_shape());
    toProto(shape, call.workSeconds() - begin, *frame.mutable_report());
    frame.set_smallest_area_ratio(areas.smallestRatio(shape.solution));
    write(std::move(response));
  }
}

}  // namespace shaped::server
