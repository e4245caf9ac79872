#include "server/rpc/geodesic_curves.h"

#include <algorithm>

#include "core/curve/bezier.h"
#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/shell/energy.h"
#include "server/convert/curve.h"
#include "server/convert/model.h"
#include "server/convert/report.h"
#include "server/rpc/curve_stream.h"

namespace shaped::server {
namespace {

constexpr int kLeastFrames = 2, kMostFrames = 10'000, kMostAuxiliary = 1000, kMostControls = 32;
constexpr int kDefaultGeodesicFrames = 64, kDefaultBezierFrames = 32;

TopologyPtr ownTopology(const v1::CurveTopology::Faces& message, const Limits& limits) {
  const std::string field = "topology.faces";
  auto faces = facesFromProto(message.faces(), message.vertex_count(), limits, field + ".faces");
  auto topology = std::make_shared<const Topology>(static_cast<std::int32_t>(message.vertex_count()), std::move(faces));
  requireOneComponent(*topology, field + ".faces");
  return topology;
}

TopologyPtr topologyOf(const TopologySources& sources, const v1::CurveTopology& message, Call& call) {
  switch (message.source_case()) {
    case v1::CurveTopology::kDataset:
      return sources.datasets.topology(message.dataset());
    case v1::CurveTopology::kModel: {
      const auto model = sources.models.pin(selectorFromProto(message.model()));
      call.setModel(model->name, model->version);
      return model->shapes->topologyPtr();
    }
    case v1::CurveTopology::kFaces:
      return ownTopology(message.faces(), sources.limits);
    case v1::CurveTopology::SOURCE_NOT_SET:
      break;
  }
  throw InvalidInput("topology", "is missing; name a dataset or a model, or send faces");
}

/// Writes the frames and what is said of them.
template <class Response, class Solution>
void answer(const Topology& topology, const Solved<Solution>& solved, int geodesics, double path_energy, double bending,
            CurveStream<Response>& stream, Call& call) {
  countCurve(solved, call);
  const auto& frames = solved.solution.curve.frames;
  stream.frames(frames);
  stream.summary([&](v1::GeodesicSummary& summary) {
    toProto(solved, call.workSeconds(), *summary.mutable_report());
    summary.set_path_energy(path_energy);
    summary.set_dimension(static_cast<std::uint32_t>(solved.solution.dimension));
    summary.set_missing(solved.solution.missing);
    const ReferenceAreas areas(topology.faces(), frames.front());
    double ratio = 1;
    for (const auto& frame : frames) ratio = std::min(ratio, areas.smallestRatio(frame));
    summary.set_smallest_area_ratio(ratio);
    summary.set_bending(bending);
    summary.set_geodesics(static_cast<std::uint32_t>(geodesics));
  });
}

}  // namespace

void geodesic(const TopologySources& sources, const v1::GeodesicRequest& request,
              const std::function<void(v1::GeodesicResponse&&)>& write, Call& call) {
  const auto topology = topologyOf(sources, request.topology(), call);
  const auto from = shapeFromProto(request.from(), *topology, "from");
  const auto to = shapeFromProto(request.to(), *topology, "to");
  auto options = geodesicFromProto(request.options(), "options");
  options.frames = numberFromProto(request.frames(), kDefaultGeodesicFrames, kLeastFrames, kMostFrames, "frames");
  options.stop = call.stopToken();
  requireCurveFits(options.frames, topology->vertexCount(), sources.limits, "frames");
  const double bending = bendingFromProto(request.bending(), defaultBending(from));
  CurveStream<v1::GeodesicResponse> stream(write, *topology);
  const auto solved =
      geodesicByFlow(std::make_shared<const ShellStructure>(topology), bending, from, to, options, stream.progress());
  answer(*topology, solved, 1, solved.solution.path_energy, bending, stream, call);
}

void bezier(const TopologySources& sources, const v1::BezierRequest& request,
            const std::function<void(v1::BezierResponse&&)>& write, Call& call) {
  const auto topology = topologyOf(sources, request.topology(), call);
  if (request.controls_size() < 2 || request.controls_size() > kMostControls)
    throw InvalidInput("controls", "has " + std::to_string(request.controls_size()) + " shapes, want 2 to " +
                                       std::to_string(kMostControls));
  std::vector<Vertices> controls;
  for (int i = 0; i < request.controls_size(); ++i)
    controls.push_back(shapeFromProto(request.controls(i), *topology, "controls[" + std::to_string(i) + "]"));
  BezierOptions options;
  options.frames = numberFromProto(request.frames(), kDefaultBezierFrames, kLeastFrames, kMostFrames, "frames");
  options.auxiliary =
      numberFromProto(request.auxiliary_frames(), options.auxiliary, kLeastFrames, kMostAuxiliary, "auxiliary_frames");
  options.geodesic = geodesicFromProto(request.options(), "options");
  options.geodesic.stop = call.stopToken();
  const std::int64_t held = options.frames + std::int64_t{options.auxiliary} * request.controls_size();
  requireCurveFits(held, topology->vertexCount(), sources.limits, "frames");
  const double bending = bendingFromProto(request.bending(), defaultBending(controls.front()));
  CurveStream<v1::BezierResponse> stream(write, *topology);
  const auto structure = std::make_shared<const ShellStructure>(topology);
  const auto solved = bezierCurve(structure, bending, controls, options, stream.progress());
  double energy = 0;
  if (solved.termination != Termination::kCancelled)
    for (const double segment :
         segmentEnergies(*topology, bending, solved.solution.curve, measuresOf(*topology, solved.solution.curve)))
      energy += segment;
  answer(*topology, solved, solved.solution.geodesics, energy, bending, stream, call);
}

}  // namespace shaped::server
