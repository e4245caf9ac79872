#include "client/shapectl/clothing_output.h"

#include <cstdio>

#include "client/shapectl/answer.h"
#include "client/shapectl/coefficients.h"
#include "client/shapectl/output.h"

namespace shaped::shapectl {
namespace {

using Body = v1::EstimateUnderClothingResponse::Body;
using Frame = v1::EstimateUnderClothingResponse::Frame;

constexpr auto kHeading = "frame  ended              inside     gap    seen  explained  trusted\n";

nlohmann::json toJson(const Frame& frame, const std::string& scan) {
  nlohmann::json document{{"frame", frame.frame()},
                          {"scan", scan},
                          {"smallest_area_ratio", frame.smallest_area_ratio()},
                          {"coefficients", shapectl::toJson(frame.coefficients())},
                          {"seen", frame.seen()},
                          {"inside", frame.inside()},
                          {"inside_strictly", frame.inside_strictly()},
                          {"mean_gap", frame.mean_gap()},
                          {"explained", frame.explained()},
                          {"trusted", frame.trusted()},
                          {"warnings", frame.warnings()}};
  addReport(document, frame.report());
  document.erase("seconds");  // nobody measured them
  return document;
}

std::string lineOf(const Frame& frame) {
  char line[160];
  std::snprintf(line, sizeof line, "%5u  %-17s  %4.0f %%  %4.0f mm  %4.0f %%  %7.1f %%  %s\n", frame.frame(),
                nameOf(frame.report().termination()).c_str(), 100 * frame.inside(), 1000 * frame.mean_gap(),
                100 * frame.seen(), 100 * frame.explained(), frame.trusted() ? "yes" : "no");
  return line;
}

}  // namespace

void ClothingOutput::set(const Body& body) {
  document_ = documentOf(body);
  document_["coefficients"] = shapectl::toJson(body.coefficients());
  document_["warnings"] = body.warnings();
  document_["frames"] = nlohmann::json::array();
  body_text_ = answerText(body) + "\n";
  code_ = exitCodeOf(body.report());
  for (const auto& warning : body.warnings()) warnings_ += "warning: " + warning + "\n";
}

void ClothingOutput::add(const Frame& frame) {
  const auto& scan = scans_.at(frame.frame());
  document_["frames"].push_back(toJson(frame, scan));
  table_ += lineOf(frame);
  if (frame.report().termination() == v1::TERMINATION_NUMERICAL_FAILURE) code_ = ExitCode::kNotConverged;
  for (const auto& warning : frame.warnings())
    warnings_ += "warning: frame " + std::to_string(frame.frame()) + " (" + scan + "): " + warning + "\n";
}

std::string ClothingOutput::text() const { return body_text_ + kHeading + table_ + warnings_; }

}  // namespace shaped::shapectl
