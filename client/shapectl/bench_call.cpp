#include "client/shapectl/bench_call.h"

#include <algorithm>
#include <functional>
#include <map>

#include "client/marker_fit.h"
#include "client/mesh.h"
#include "client/models.h"
#include "client/shapectl/numbers.h"
#include "client/shapectl/output.h"
#include "core/numerics/error.h"
#include "shaped/v1/shapes.grpc.pb.h"

namespace shaped::shapectl {
namespace {

constexpr int kHandles = 6, kMarkers = 30;
/// Handles and ends of paths differ from the mean by so much of its size: the solvers have something to do.
constexpr double kStretch = 0.03;

grpc::ByteBuffer packed(const google::protobuf::Message& message) {
  const grpc::Slice slice(message.SerializeAsString());
  return {&slice, 1};
}

/// What the builders below take their inputs from.
struct Source {
  const BenchInputs& inputs;
  const std::shared_ptr<grpc::Channel>& channel;
  const client::CallOptions& options;

  client::ModelMesh model() const {
    if (inputs.model.empty()) throw InvalidInput("--model", "is missing: this method needs a model");
    return client::getModelMesh(channel, parseModel(inputs.model), options);
  }
  std::uint32_t modes() const { return countOf("--modes", inputs.modes); }
  std::uint32_t frames() const {
    constexpr std::int64_t most = 10000;
    if (inputs.frames < 1 || inputs.frames > most)
      throw InvalidInput("--frames", "= " + std::to_string(inputs.frames) + ", want 1 to 10000");
    return countOf("--frames", inputs.frames);
  }
};

client::LoadCall unary(const std::string& method, const google::protobuf::Message& request) {
  return {.method = method, .requests = {packed(request)}};
}

/// The shape that is asked about.
Vertices shapeOf(const Source& source, const client::ModelMesh& model) {
  if (source.inputs.mesh.empty()) return model.mean;
  return client::unpack(client::readShape(source.inputs.mesh, model.mean.rows(), model.faces).positions());
}

/// The shape, and where there is none of its own, the mean drawn out along x.
Vertices otherShape(const Source& source, const client::ModelMesh& model) {
  auto shape = shapeOf(source, model);
  if (source.inputs.mesh.empty()) shape.col(0) *= 1 + kStretch;
  return shape;
}

/// Vertices that lie far from each other: each is the farthest one from those before.
std::vector<std::int32_t> scattered(const Vertices& shape, int count) {
  std::vector<std::int32_t> chosen{0};
  Eigen::VectorXd distance = (shape.rowwise() - shape.row(0)).rowwise().squaredNorm();
  while (std::ssize(chosen) < std::min<std::ptrdiff_t>(count, shape.rows())) {
    Eigen::Index farthest = 0;
    distance.maxCoeff(&farthest);
    chosen.push_back(static_cast<std::int32_t>(farthest));
    distance = distance.cwiseMin((shape.rowwise() - shape.row(farthest)).rowwise().squaredNorm());
  }
  return chosen;
}

template <class Request>
Request requestTo(const client::ModelMesh& model) {
  Request request;
  *request.mutable_model() = client::pinned(model.description);
  return request;
}

v1::ProjectRequest projectRequest(const Source& source) {
  const auto model = source.model();
  auto request = requestTo<v1::ProjectRequest>(model);
  client::pack(shapeOf(source, model), *request.mutable_shape()->mutable_positions());
  request.set_modes(source.modes());
  return request;
}

client::LoadCall synthesizeCall(const Source& source) {
  const auto projection = projectRequest(source);
  client::Call call(source.options);
  v1::ProjectResponse answer;
  client::require(v1::Shapes::NewStub(source.channel)->Project(call.context(), projection, &answer));
  v1::SynthesizeRequest request;
  *request.mutable_model() = projection.model();
  *request.mutable_coefficients() = answer.coefficients();
  return unary("/shaped.v1.Shapes/Synthesize", request);
}

client::LoadCall scoreCall(const Source& source) {
  const auto projection = projectRequest(source);
  v1::ScoreRequest request;
  *request.mutable_model() = projection.model();
  *request.mutable_shape() = projection.shape();
  return unary("/shaped.v1.Shapes/Score", request);
}

client::LoadCall editCall(const Source& source) {
  const auto model = source.model();
  auto request = requestTo<v1::EditRequest>(model);
  const auto shape = otherShape(source, model);
  for (const auto vertex : scattered(model.mean, kHandles)) {
    auto& handle = *request.add_handles();
    handle.set_vertex(static_cast<std::uint32_t>(vertex));
    handle.set_x(shape(vertex, 0));
    handle.set_y(shape(vertex, 1));
    handle.set_z(shape(vertex, 2));
  }
  request.set_modes(source.modes());
  return unary("/shaped.v1.Shapes/Edit", request);
}

client::LoadCall interpolateCall(const Source& source) {
  const auto model = source.model();
  v1::InterpolateRequest request;
  *request.mutable_from() = client::pack(MeshFile{model.mean, model.faces});
  client::pack(otherShape(source, model), *request.mutable_to()->mutable_positions());
  request.set_path_steps(countOf("--path-steps", source.inputs.path_steps));
  const auto frames = source.frames();
  for (std::uint32_t i = 0; i < frames; ++i) request.add_times(frames == 1 ? 0 : static_cast<double>(i) / (frames - 1));
  auto call = unary("/shaped.v1.Shapes/Interpolate", request);
  call.streams = true;
  return call;
}

/// What streaming frames costs: a path of one step whose frames are all its first end, so that nothing is solved.
client::LoadCall framesCall(const Source& source) {
  if (source.inputs.mesh.empty()) throw InvalidInput("--mesh", "is missing: this method streams copies of a mesh");
  const auto mesh = readMesh(source.inputs.mesh);
  v1::InterpolateRequest request;
  *request.mutable_from() = client::pack(mesh);
  *request.mutable_to()->mutable_positions() = request.from().positions();
  request.set_path_steps(1);
  request.set_bending(1e-4);  // any: the default asks for the mesh's diameter, seconds at 40,000 vertices
  request.mutable_times()->Resize(static_cast<int>(source.frames()), 0);
  auto call = unary("/shaped.v1.Shapes/Interpolate", request);
  call.streams = true;
  return call;
}

MarkerSet markersOn(const Vertices& shape) {
  MarkerSet set;
  for (const auto vertex : scattered(shape, kMarkers))
    set.markers.push_back({.label = "m" + std::to_string(vertex), .vertex = vertex});
  return set;
}

client::LoadCall fitCall(const Source& source) {
  const auto model = source.model();
  const auto shape = shapeOf(source, model);
  const auto set = markersOn(model.mean);
  v1::FitMarkersRequest message;
  auto& setup = *message.mutable_setup();
  *setup.mutable_model() = client::pinned(model.description);
  *setup.mutable_marker_set() = client::pack(set);
  setup.set_modes(source.modes());
  setup.set_scale(1);
  client::LoadCall call{.method = "/shaped.v1.Shapes/FitMarkers", .requests = {packed(message)}, .streams = true};
  Vertices positions(std::ssize(set.markers), 3);
  for (Eigen::Index i = 0; i < positions.rows(); ++i)
    positions.row(i) = shape.row(set.markers[static_cast<std::size_t>(i)].vertex);
  const auto frames = source.frames();
  for (std::uint32_t i = 0; i < frames; ++i) {
    message.mutable_frame()->set_frame(i);
    client::pack(positions, *message.mutable_frame()->mutable_positions());
    call.requests.push_back(packed(message));
  }
  return call;
}

/// The cheapest evaluation that there is: one mode, two trainings.
client::LoadCall evaluateCall(const Source& source) {
  auto request = requestTo<v1::EvaluateRequest>(source.model());
  request.add_modes(1);
  request.set_specificity_samples(0);
  request.set_folds(2);
  return unary("/shaped.v1.Shapes/Evaluate", request);
}

client::LoadCall getCall(const Source& source, bool with_mean) {
  auto request = requestTo<v1::GetModelRequest>(source.model());
  request.set_with_mean(with_mean);
  return unary("/shaped.v1.Models/Get", request);
}

/// A call whose request is empty.
std::function<client::LoadCall(const Source&)> plain(const std::string& method) {
  return [method](const Source&) {
    return client::LoadCall{.method = method, .requests = {grpc::ByteBuffer(nullptr, 0)}};
  };
}

const std::map<std::string, std::function<client::LoadCall(const Source&)>>& methods() {
  static const std::map<std::string, std::function<client::LoadCall(const Source&)>> all{
      {"health", plain("/grpc.health.v1.Health/Check")},
      {"limits", plain("/shaped.v1.Server/GetLimits")},
      {"statistics", plain("/shaped.v1.Admin/GetStatistics")},
      {"models", plain("/shaped.v1.Models/List")},
      {"datasets", plain("/shaped.v1.Datasets/List")},
      {"jobs", plain("/shaped.v1.Jobs/List")},
      {"describe", [](const Source& source) { return getCall(source, false); }},
      {"mean", [](const Source& source) { return getCall(source, true); }},
      {"project", [](const Source& source) { return unary("/shaped.v1.Shapes/Project", projectRequest(source)); }},
      {"synthesize", synthesizeCall},
      {"score", scoreCall},
      {"edit", editCall},
      {"interpolate", interpolateCall},
      {"frames", framesCall},
      {"fit", fitCall},
      {"evaluate", evaluateCall},
  };
  return all;
}

}  // namespace

std::string benchMethods() {
  std::string names;
  for (const auto& [name, make] : methods()) names += (names.empty() ? "" : ", ") + name;
  return names;
}

client::LoadCall makeBenchCall(const std::string& method, const BenchInputs& inputs,
                               const std::shared_ptr<grpc::Channel>& channel, const client::CallOptions& options) {
  const auto found = methods().find(method);
  if (found == methods().end()) throw InvalidInput("METHOD", "\"" + method + "\", want one of " + benchMethods());
  return found->second({inputs, channel, options});
}

}  // namespace shaped::shapectl
