#include "client/shapectl/output.h"

#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <charconv>
#include <iostream>
#include <sstream>

#include "core/numerics/error.h"

namespace shaped::shapectl {

void printJson(const nlohmann::json& document) {
  // Names from files may hold any bytes: what is no UTF-8 is replaced rather than refused.
  std::cout << document.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << "\n";
}

std::string nameOf(v1::Termination termination) {
  constexpr std::string_view prefix = "TERMINATION_";
  std::string name = v1::Termination_Name(termination).substr(prefix.size());
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  return name;
}

std::string timeText(const google::protobuf::Timestamp& time) {
  return time.seconds() == 0 ? "" : google::protobuf::util::TimeUtil::ToString(time);
}

std::string modelText(const v1::ModelVersion& model) {
  return model.name().empty() ? "" : model.name() + "@" + std::to_string(model.version());
}

void addReport(nlohmann::json& document, const v1::SolverReport& report) {
  document["termination"] = nameOf(report.termination());
  document["iterations"] = report.iterations();
  document["residual"] = report.residual();
  document["seconds"] = report.seconds();
}

void addModel(nlohmann::json& document, const v1::ModelVersion& model) {
  document["model"] = {{"name", model.name()}, {"version", model.version()}};
}

std::string reportText(const v1::SolverReport& report) {
  std::ostringstream text;
  text << nameOf(report.termination()) << " after " << report.iterations() << " iterations, residual "
       << report.residual() << ", " << report.seconds() << " s";
  return text.str();
}

ExitCode exitCodeOf(const v1::SolverReport& report) {
  return report.termination() == v1::TERMINATION_CONVERGED ? ExitCode::kSuccess : ExitCode::kNotConverged;
}

v1::ModelSelector parseModel(const std::string& text) {
  v1::ModelSelector selector;
  const auto at = text.find('@');
  selector.set_name(text.substr(0, at));
  if (at == std::string::npos) return selector;
  std::uint64_t version = 0;
  const auto* end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data() + at + 1, end, version);
  const bool number = error == std::errc() && stopped == end;
  if (at + 1 == text.size() || (number && version == 0))
    throw InvalidInput(text, "a model is NAME, NAME@VERSION with a version of 1 or more, or NAME@LABEL");
  number ? selector.set_version(version) : selector.set_label(text.substr(at + 1));
  return selector;
}

}  // namespace shaped::shapectl
