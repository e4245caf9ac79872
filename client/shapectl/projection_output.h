#pragma once

#include <nlohmann/json.hpp>

#include "shaped/v1/shapes.pb.h"

namespace shaped::shapectl {

/// What a projection says beside the shape.
nlohmann::json projectionDocument(const v1::ProjectResponse& response);

}  // namespace shaped::shapectl
