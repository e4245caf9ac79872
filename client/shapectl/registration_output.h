#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "shaped/v1/registration.pb.h"

namespace shaped::shapectl {

/// What a registration says beside the shape.
nlohmann::json registrationDocument(const v1::RegisterResponse& response);

/// The same for people: a line, and one for each warning.
std::string registrationText(const v1::RegisterResponse& response);

}  // namespace shaped::shapectl
