#include "core/registration/standing_body.h"

#include "core/mesh/quality.h"
#include "core/registration/deformation.h"

namespace shaped {

StandingBody::StandingBody(const BodyModel& model, const BodyState& state)
    : model_(model),
      pose_(state.pose),
      rest_(model.rest(state.identity)),
      rest_normals_(vertexNormals(model.topology()->faces(), rest_)),
      rest_joints_(model.restJoints(state.identity)),
      skin_(model.skeleton(), model.parts().weights, rest_, rest_joints_, pose_),
      normals_(vertexNormals(model.topology()->faces(), skin_.vertices())),
      areas_(areaShares(model.topology()->faces(), skin_.vertices())) {}

}  // namespace shaped
