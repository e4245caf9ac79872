#include "server/rpc/motion_curves.h"

#include <algorithm>
#include <cmath>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/shell/energy.h"
#include "server/convert/curve.h"
#include "server/convert/report.h"
#include "server/rpc/curve_stream.h"

namespace shaped::server {
namespace {

constexpr int kDefaultSmoothingSteps = 10, kDefaultJoiningSteps = 50;
constexpr int kLeastWindow = 8, kMostWindow = 10'000;
constexpr int kMostClips = 32, kMostTransition = 1000, kMostReach = 10'000;

LongClipOptions optionsFrom(const v1::SmoothRequest& request, const DatasetFrames& frames, const Limits& limits,
                            std::stop_token stop) {
  LongClipOptions options;
  options.closed = request.closed();
  const auto vertices = frames.topology()->vertexCount();
  options.smoothing = smoothingFromProto(request.flow(), vertices, kDefaultSmoothingSteps, "flow");
  options.smoothing.flow.stop = std::move(stop);
  options.smoothing.flow.restore = restoreFromProto(request.restore(), frames.count());
  if (!(request.restore_scale() >= 0 && std::isfinite(request.restore_scale())))
    throw InvalidInput("restore_scale", "= " + std::to_string(request.restore_scale()) + ", want 0 or more [m]");
  options.smoothing.flow.restore_scale = request.restore_scale();
  options.smoothing.flow.held = heldFromProto(request.held(), frames.count());
  options.window =
      numberFromProto(request.window(), static_cast<int>(options.window), kLeastWindow, kMostWindow, "window");
  // Many steps reach so far that a window sees more frames than it was asked to have.
  const auto reach = flowReach(options.smoothing.steps, options.smoothing.flow.tau);
  const auto seen = std::max(options.window, 2 * (reach + options.blend) + 1);
  const bool whole = options.closed || frames.count() <= options.window;
  requireCurveFits(whole ? frames.count() : std::min(seen, frames.count()), vertices, limits,
                   whole ? "dataset" : "window");
  return options;
}

/// All frames of the clips, which must have one connectivity.
std::vector<std::vector<Vertices>> clipsFrom(const DatasetStore& datasets, const Limits& limits,
                                             const v1::JoinRequest& request, TopologyPtr& topology) {
  if (request.datasets_size() < 2 || request.datasets_size() > kMostClips)
    throw InvalidInput("datasets", "has " + std::to_string(request.datasets_size()) + " names, want 2 to " +
                                       std::to_string(kMostClips));
  std::vector<DatasetFrames> readers;
  std::int64_t frames = 0;
  for (int k = 0; k < request.datasets_size(); ++k) {
    readers.push_back(datasets.open(request.datasets(k)));
    frames += readers.back().count();
    if (readers.back().topology()->id() != readers.front().topology()->id())
      throw InvalidInput("datasets[" + std::to_string(k) + "]",
                         "has another connectivity than \"" + request.datasets(0) + "\"");
  }
  topology = readers.front().topology();
  requireCurveFits(frames, topology->vertexCount(), limits, "datasets");
  std::vector<std::vector<Vertices>> clips;
  for (const auto& reader : readers) {
    clips.emplace_back();
    for (std::int64_t i = 0; i < reader.count(); ++i) clips.back().push_back(reader.frame(i));
  }
  return clips;
}

JoinOptions optionsFrom(const v1::JoinRequest& request, Eigen::Index vertices, const std::stop_token& stop) {
  JoinOptions options;
  if (request.has_transition_frames())
    options.transition = numberFromProto(request.transition_frames(), 0, 0, kMostTransition, "transition_frames");
  options.up = upFromProto(request.up());
  if (request.has_reach()) options.reach = numberFromProto(request.reach(), 0, 0, kMostReach, "reach");
  options.smoothing = smoothingFromProto(request.flow(), vertices, kDefaultJoiningSteps, "flow");
  options.smoothing.flow.stop = stop;
  options.geodesic = geodesicFromProto(request.options(), "options");
  options.geodesic.stop = stop;
  return options;
}

/// Frames of the clips against themselves as they came; those between clips have nothing to be compared with.
double smallestRatio(const Topology& topology, const Vertices& reference, const std::vector<Vertices>& frames) {
  const ReferenceAreas areas(topology.faces(), reference);
  double ratio = 1;
  for (const auto& frame : frames) ratio = std::min(ratio, areas.smallestRatio(frame));
  return ratio;
}

}  // namespace

void smooth(const DatasetStore& datasets, const Limits& limits, const v1::SmoothRequest& request,
            const std::function<void(v1::SmoothResponse&&)>& write, Call& call) {
  const auto frames = datasets.open(request.dataset());
  const auto options = optionsFrom(request, frames, limits, call.stopToken());
  const double bending = bendingFromProto(request.bending(), defaultBending(frames.frame(0)));
  const auto structure = std::make_shared<const ShellStructure>(frames.topology());
  CurveStream<v1::SmoothResponse> stream(write, *frames.topology());
  const FrameSource source{frames.count(), [&](std::int64_t i) { return frames.frame(i); }};
  const auto sink = [&](std::int64_t i, const Vertices& frame) { stream.frame(i, frame); };
  const auto solved = smoothLongClip(structure, bending, source, options, sink, stream.progress());
  countCurve(solved, call);
  stream.summary([&](v1::SmoothSummary& summary) {
    toProto(solved, call.workSeconds(), *summary.mutable_report());
    toProto(solved.solution, summary);
    summary.set_bending(bending);
  });
}

void join(const DatasetStore& datasets, const Limits& limits, const v1::JoinRequest& request,
          const std::function<void(v1::JoinResponse&&)>& write, Call& call) {
  TopologyPtr topology;
  const auto clips = clipsFrom(datasets, limits, request, topology);
  const auto options = optionsFrom(request, topology->vertexCount(), call.stopToken());
  const auto& first = clips.front().front();
  const double bending = bendingFromProto(request.bending(), defaultBending(first));
  CurveStream<v1::JoinResponse> stream(write, *topology);
  const auto solved =
      joined(std::make_shared<const ShellStructure>(topology), bending, clips, options, stream.progress());
  countCurve(solved, call);
  stream.frames(solved.solution.curve.frames);
  stream.summary([&](v1::JoinSummary& summary) {
    toProto(solved.solution, summary);
    auto& smooth = *summary.mutable_smooth();
    toProto(solved, call.workSeconds(), *smooth.mutable_report());
    smooth.set_smallest_area_ratio(smallestRatio(*topology, first, solved.solution.curve.frames));
    smooth.set_bending(bending);
  });
}

}  // namespace shaped::server
