#include "client/shapectl/coefficients.h"

#include "core/io/file.h"
#include "core/io/json_fields.h"
#include "core/numerics/error.h"

namespace shaped::shapectl {

nlohmann::json toJson(const v1::Coefficients& coefficients) {
  if (coefficients.body_size() > 0) return {{"body", coefficients.body()}};
  return {{"alpha", coefficients.alpha()}, {"scale", coefficients.scale()}};
}

void writeCoefficients(const std::filesystem::path& path, const v1::Coefficients& coefficients) {
  writeFile(path, toJson(coefficients).dump(2) + "\n");
}

v1::Coefficients readCoefficients(const std::filesystem::path& path) {
  auto document = parseJson(path.string(), readFile(path));
  try {
    if (document.contains("coefficients")) document = document.at("coefficients");
    v1::Coefficients coefficients;
    if (document.contains("body")) {
      for (const auto& number : document.at("body")) coefficients.add_body(number.get<double>());
      return coefficients;
    }
    for (const auto& weight : document.at("alpha")) coefficients.add_alpha(weight.get<double>());
    coefficients.set_scale(document.value("scale", 1.0));
    return coefficients;
  } catch (const nlohmann::json::exception& error) {
    throw InvalidInput(
        path.string(),
        std::string("want {\"alpha\": [numbers], \"scale\": number} or {\"body\": [numbers]}: ") + error.what());
  }
}

nlohmann::json toJson(const v1::Score& score) {
  return {{"mahalanobis", score.mahalanobis()},
          {"log_likelihood", score.log_likelihood()},
          {"residual_distance", score.residual_distance()}};
}

}  // namespace shaped::shapectl
