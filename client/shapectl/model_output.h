#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "shaped/v1/model.pb.h"

namespace shaped::shapectl {

/// "symmetric" or "directed".
std::string pathEnergyText(v1::PathEnergy energy);

/// "ready", "stored" and so on.
std::string nameOf(v1::ModelState state);

/// State, memory and labels for people: "ready 12 MiB serving stable".
std::string stateText(const v1::ModelDescription& description);

nlohmann::json toJson(const v1::ModelDescription& description);

/// "none", "skeleton", "local".
std::string nameOf(v1::PostureNormalisation posture);

/// What models of every kind have.
struct ModelSize {
  std::uint32_t training_shapes, modes;
};
ModelSize sizeOf(const v1::ModelDescription& description);

}  // namespace shaped::shapectl
