#include "server/rpc/shape_handlers.h"

#include "core/model/shell_pga_tasks.h"
#include "core/numerics/error.h"
#include "server/convert/mesh.h"
#include "server/convert/model.h"
#include "server/models/kind.h"
#include "server/rpc/answer.h"

namespace shaped::server {
namespace {

constexpr int kMostOuterIterations = 1000;

Handle handleFromProto(const v1::Handle& message, const Topology& topology, std::size_t index) {
  if (message.vertex() >= static_cast<std::uint32_t>(topology.vertexCount()))
    throw InvalidInput(
        "handles[" + std::to_string(index) + "].vertex",
        "= " + std::to_string(message.vertex()) + " is outside [0, " + std::to_string(topology.vertexCount()) + ")");
  return {static_cast<std::int32_t>(message.vertex()), {message.x(), message.y(), message.z()}};
}

}  // namespace

void fill(const ServedModel& served, const ShapeProjection& projection, bool with_shape,
          v1::ProjectResponse& response) {
  if (with_shape) toProto(projection.shape, served.shapes->topology(), *response.mutable_shape());
  toProto(projection.point, *response.mutable_coefficients());
  response.mutable_tangent_coordinates()->Add(projection.tangent_coordinates.begin(),
                                              projection.tangent_coordinates.end());
  response.set_residual_energy(projection.residual_energy);
  toProto(projection.score, *response.mutable_score());
}

void project(ModelStore& store, const v1::ProjectRequest& request, v1::ProjectResponse& response, Call& call) {
  const auto served = pinModel(store, request, call);
  const auto& model = *served->shapes;
  const auto shape = shapeFromProto(request.shape(), model.topology(), "shape");
  const ProjectionOptions options{.modes = countFromProto(request.modes(), model.modes(), "modes"),
                                  .fine = request.fine(),
                                  .stop = call.stopToken()};
  const auto solved = model.project(shape, options);
  setAnswer(*served, solved, solved.solution.smallest_area_ratio, call, response);
  fill(*served, solved.solution, true, response);
}

void synthesize(ModelStore& store, const Limits& limits, const v1::SynthesizeRequest& request,
                v1::SynthesizeResponse& response, Call& call) {
  const auto served = pinModel(store, request, call);
  const auto& model = *served->shapes;
  const auto solved = model.synthesize(coefficientsFromProto(request.coefficients(), limits),
                                       {.fine = request.fine(), .stop = call.stopToken()});
  setAnswer(*served, solved, solved.solution.smallest_area_ratio, call, response);
  toProto(solved.solution.shape, model.topology(), *response.mutable_shape());
}

void edit(ModelStore& store, const Limits& limits, const v1::EditRequest& request, v1::EditResponse& response,
          Call& call) {
  const auto served = pinModel(store, request, call);
  const auto& model = shellPgaFor("Shapes.Edit", *served);
  requireAtMost(request.handles_size(), limits.handles, "handles", "handles");
  std::vector<Handle> handles;
  for (const auto& handle : request.handles())
    handles.push_back(handleFromProto(handle, model.topology(), handles.size()));
  EditOptions options{.modes = countFromProto(request.modes(), model.modes(), "modes"), .stop = call.stopToken()};
  if (request.outer_iterations() > 0)
    options.outer_iterations = countFromProto(request.outer_iterations(), kMostOuterIterations, "outer_iterations");
  const auto solved = edit(model, handles, options);
  const auto& edited = solved.solution;
  setAnswer(*served, solved, edited.smallest_area_ratio, call, response);
  toProto(edited.shape, model.topology(), *response.mutable_shape());
  toProto(edited.projection, model.topology(), *response.mutable_projection());
  toProto(edited.coefficients, *response.mutable_coefficients());
  response.mutable_energies()->Add(edited.energies.begin(), edited.energies.end());
  response.set_largest_handle_distance(edited.largest_handle_distance);
}

void score(ModelStore& store, const v1::ScoreRequest& request, v1::ScoreResponse& response, Call& call) {
  const auto served = pinModel(store, request, call);
  const auto& model = *served->shapes;
  const auto shape = shapeFromProto(request.shape(), model.topology(), "shape");
  const auto solved = model.project(shape, {.modes = 0, .fine = false, .stop = call.stopToken()});
  setAnswer(*served, solved, solved.solution.smallest_area_ratio, call, response);
  toProto(solved.solution.score, *response.mutable_score());
}

}  // namespace shaped::server
