#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "shaped/v1/model.pb.h"

namespace shaped::shapectl {

/// {"alpha": [...], "scale": s}, or {"body": [...]} of a body.
nlohmann::json toJson(const v1::Coefficients& coefficients);
void writeCoefficients(const std::filesystem::path& path, const v1::Coefficients& coefficients);
/// Reads that form, or a document that holds it as "coefficients" (what `shapectl project --output json` prints).
/// Throws InvalidInput naming the file.
v1::Coefficients readCoefficients(const std::filesystem::path& path);

nlohmann::json toJson(const v1::Score& score);

}  // namespace shaped::shapectl
