#pragma once

#include <nlohmann/json.hpp>

#include "shaped/v1/model.pb.h"

namespace shaped::shapectl {

nlohmann::json toJson(const v1::ModelDescription& description);

}  // namespace shaped::shapectl
