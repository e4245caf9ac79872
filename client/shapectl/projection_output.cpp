#include "client/shapectl/projection_output.h"

#include "client/shapectl/answer.h"
#include "client/shapectl/coefficients.h"

namespace shaped::shapectl {

nlohmann::json projectionDocument(const v1::ProjectResponse& response) {
  auto document = documentOf(response);
  document["coefficients"] = toJson(response.coefficients());
  document["tangent_coordinates"] = response.tangent_coordinates();
  document["residual_energy"] = response.residual_energy();
  document["score"] = toJson(response.score());
  return document;
}

}  // namespace shaped::shapectl
