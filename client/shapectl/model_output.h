#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "shaped/v1/model.pb.h"

namespace shaped::shapectl {

/// "symmetric" or "directed".
std::string pathEnergyText(v1::PathEnergy energy);

nlohmann::json toJson(const v1::ModelDescription& description);

}  // namespace shaped::shapectl
