#include "client/shapectl/registration_output.h"

#include <cstdio>

#include "client/shapectl/answer.h"
#include "client/shapectl/coefficients.h"

namespace shaped::shapectl {
namespace {

nlohmann::json toJson(const v1::ScanReport& report) {
  nlohmann::json document{{"scan_median", report.scan_median()}, {"scan_mean", report.scan_mean()},
                          {"scan_95", report.scan_95()},         {"model_mean", report.model_mean()},
                          {"explained", report.explained()},     {"seen", report.seen()},
                          {"chamfer", report.chamfer()},         {"regions", nlohmann::json::array()}};
  for (const auto& region : report.regions())
    document["regions"].push_back(
        {{"name", region.name()}, {"seen", region.seen()}, {"mean_distance", region.mean_distance()}});
  return document;
}

nlohmann::json toJson(const v1::RefinementReport& report) {
  return {{"median_distance", report.median_distance()},
          {"percentile_95_distance", report.percentile_95_distance()},
          {"gated_out", report.gated_out()},
          {"smallest_area_ratio", report.smallest_area_ratio()},
          {"flipped", report.flipped()}};
}

}  // namespace

nlohmann::json registrationDocument(const v1::RegisterResponse& response) {
  auto document = documentOf(response);
  document["frame"] = response.frame();
  document["coefficients"] = toJson(response.coefficients());
  document["scan_report"] = toJson(response.scan_report());
  if (response.has_start_margin()) document["start_margin"] = response.start_margin();
  document["took_runner_up"] = response.took_runner_up();
  document["flipped_normals"] = response.flipped_normals();
  if (response.suspected_unit_factor() > 0) document["suspected_unit_factor"] = response.suspected_unit_factor();
  document["score"] = response.score();
  document["warnings"] = response.warnings();
  if (response.has_field_report()) document["field_report"] = toJson(response.field_report());
  if (response.has_refinement()) document["refinement"] = toJson(response.refinement());
  return document;
}

std::string registrationText(const v1::RegisterResponse& response) {
  const auto& report = response.scan_report();
  char numbers[160];
  std::snprintf(
      numbers, sizeof numbers,
      "\nscan to surface %.2f mm median, %.2f mm 95 %%; %.0f %% of the scan explained, %.0f %% of the model seen; "
      "score %.2f\n",
      1000 * report.scan_median(), 1000 * report.scan_95(), 100 * report.explained(), 100 * report.seen(),
      response.score());
  auto text = answerText(response) + numbers;
  if (response.has_field_report()) {
    std::snprintf(numbers, sizeof numbers, "deformed by the model's field: chamfer distance %.2f mm, %.2f mm before\n",
                  1000 * response.field_report().chamfer(), 1000 * report.chamfer());
    text += numbers;
  }
  for (const auto& warning : response.warnings()) text += "warning: " + warning + "\n";
  return text;
}

}  // namespace shaped::shapectl
