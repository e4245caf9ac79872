#include "core/registration/standing_body.h"

#include <utility>

#include "core/mesh/quality.h"
#include "core/registration/deformation.h"

namespace shaped {

StandingBody::StandingBody(const BodyModel& model, BodyState state)
    : model_(model),
      state_(std::move(state)),
      rest_(model.rest(state_.identity)),
      rest_normals_(vertexNormals(model.topology()->faces(), rest_)),
      rest_joints_(model.restJoints(state_.identity)),
      skin_(model.posed(state_)),
      normals_(vertexNormals(model.topology()->faces(), skin_.vertices())),
      areas_(areaShares(model.topology()->faces(), skin_.vertices())) {}

}  // namespace shaped
