#pragma once

#include "core/model/shape_model.h"
#include "server/convert/limits.h"
#include "server/models/model_store.h"
#include "server/rpc/call.h"
#include "shaped/v1/shapes.pb.h"

namespace shaped::server {

// The unary methods of Shapes on a solver thread: translate, call, translate. Throw as statusOf says.
void project(ModelStore& store, const v1::ProjectRequest& request, v1::ProjectResponse& response, Call& call);
void synthesize(ModelStore& store, const Limits& limits, const v1::SynthesizeRequest& request,
                v1::SynthesizeResponse& response, Call& call);
void edit(ModelStore& store, const Limits& limits, const v1::EditRequest& request, v1::EditResponse& response,
          Call& call);
void score(ModelStore& store, const v1::ScoreRequest& request, v1::ScoreResponse& response, Call& call);

/// What Project answers beside what every answer carries.
void fill(const ServedModel& served, const ShapeProjection& projection, bool with_shape, v1::ProjectResponse& response);

}  // namespace shaped::server
