#include "client/shapectl/fit_report.h"

#include <algorithm>
#include <cmath>
#include <iostream>

#include "client/shapectl/output.h"
#include "core/io/file.h"

namespace shaped::shapectl {

SolverTally::SolverTally() { report_.set_termination(v1::TERMINATION_CONVERGED); }

void SolverTally::add(const v1::SolverReport& report, double smallest_area_ratio) {
  if (report_.termination() == v1::TERMINATION_CONVERGED) report_.set_termination(report.termination());
  report_.set_iterations(report_.iterations() + report.iterations());
  report_.set_residual(std::max(report_.residual(), report.residual()));
  report_.set_seconds(report_.seconds() + report.seconds());
  smallest_area_ratio_ = std::min(smallest_area_ratio_, smallest_area_ratio);
}

nlohmann::json SolverTally::document() const {
  nlohmann::json document{{"smallest_area_ratio", smallest_area_ratio_}};
  addReport(document, report_);
  return document;
}

FitReport::FitReport(std::vector<std::string> labels)
    : labels_(std::move(labels)), sums_(labels_.size()), counts_(labels_.size()) {}

void FitReport::add(const v1::FitMarkersResponse& response) {
  model_ = response.model();
  nlohmann::json frame{
      {"frame", response.frame()}, {"rms", response.rms()}, {"smallest_area_ratio", response.smallest_area_ratio()}};
  addReport(frame, response.report());
  auto& residuals = frame["residuals"] = nlohmann::json::object();
  for (std::size_t i = 0; i < labels_.size(); ++i) addResidual(residuals, i, response.residuals(static_cast<int>(i)));
  frames_.push_back(std::move(frame));
  solver_.add(response.report(), response.smallest_area_ratio());
}

void FitReport::addResidual(nlohmann::json& residuals, std::size_t marker, double residual) {
  residuals[labels_[marker]] = residual;  // NaN, a marker not seen, becomes null
  if (!std::isfinite(residual)) return;
  sums_[marker] += residual * residual;
  counts_[marker] += 1;
}

nlohmann::json FitReport::document(bool with_frames) const {
  auto document = solver_.document();
  document["frame_count"] = frames_.size();
  addModel(document, model_);
  auto& markers = document["marker_rms"] = nlohmann::json::object();
  for (std::size_t i = 0; i < labels_.size(); ++i)
    markers[labels_[i]] = counts_[i] > 0 ? std::sqrt(sums_[i] / counts_[i]) : std::nan("");
  document["rms"] = rms();
  if (with_frames) document["frames"] = frames_;
  return document;
}

double FitReport::rms() const {
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < labels_.size(); ++i) sum += sums_[i], count += counts_[i];
  return count > 0 ? std::sqrt(sum / count) : std::nan("");
}

void FitReport::write(const std::string& file) const {
  writeFile(file, document(true).dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

void FitReport::print(const Session& session) const {
  const auto all = document(false);
  if (session.json) return printJson(all);
  std::cout << all["frame_count"] << " frames: " << reportText(solver()) << "\nRMS " << 1000 * rms()
            << " mm, smallest area ratio " << all["smallest_area_ratio"] << "\n";
}

}  // namespace shaped::shapectl
