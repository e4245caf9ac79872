#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/shapectl/session.h"
#include "shaped/v1/shapes.pb.h"

namespace shaped::shapectl {

/// How many answers ended together: iterations and seconds add up, the first that did not converge names the
/// termination, the largest residual and the smallest area ratio are kept.
class SolverTally {
 public:
  SolverTally();

  void add(const v1::SolverReport& report, double smallest_area_ratio);
  const v1::SolverReport& report() const { return report_; }
  double smallestAreaRatio() const { return smallest_area_ratio_; }
  nlohmann::json document() const;

 private:
  v1::SolverReport report_;
  double smallest_area_ratio_ = 1;
};

/// Gathers the answers to a take's frames.
class FitReport {
 public:
  /// Of the markers, in the order of the residuals.
  explicit FitReport(std::vector<std::string> labels);

  void add(const v1::FitMarkersResponse& response);
  const v1::SolverReport& solver() const { return solver_.report(); }
  /// Everything; without the frames for the terminal.
  nlohmann::json document(bool with_frames) const;
  /// [m]
  double rms() const;

  /// Writes everything. Throws FileError.
  void write(const std::string& file) const;
  void print(const Session& session) const;

 private:
  void addResidual(nlohmann::json& residuals, std::size_t marker, double residual);

  const std::vector<std::string> labels_;
  std::vector<double> sums_, counts_;  // squared residuals per marker
  v1::ModelVersion model_;
  SolverTally solver_;
  nlohmann::json frames_ = nlohmann::json::array();
};

}  // namespace shaped::shapectl
