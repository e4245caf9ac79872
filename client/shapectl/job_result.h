#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/shapectl/bootstrap_output.h"
#include "client/shapectl/exit_code.h"
#include "client/shapectl/fit_report.h"
#include "client/shapectl/session.h"
#include "core/io/frames.h"
#include "shaped/v1/jobs.pb.h"

namespace shaped::shapectl {

/// Where the parts of a result go; empty: nowhere but to stdout.
struct ResultFiles {
  std::string out;     ///< shapes, n x V x 3 .npy
  std::string report;  ///< answers, JSON
  std::string plot;    ///< of an evaluation, SVG
};

/// Takes the answers of a batch job, of whatever kind, and prints what the verb of that kind prints.
class JobResultOutput {
 public:
  /// labels: of the markers, for the report; without, they are called by their index.
  explicit JobResultOutput(ResultFiles files, std::vector<std::string> labels = {});

  /// Throws InvalidInput naming "--out" when shapes are wanted and the answers have none, FileError.
  void add(const v1::GetJobResultResponse& answer);
  /// All answers have come: writes files, prints, and says how the solvers ended. Call once, last.
  ExitCode finish(const Session& session);

 private:
  void addFit(const v1::FitMarkersResponse& response);
  void addProjection(const v1::ProjectResponse& response);
  void addShape(const v1::Shape& shape);
  ExitCode finishBootstrap(const Session& session) const;
  ExitCode finishProjections(const Session& session) const;

  const ResultFiles files_;
  std::vector<std::string> labels_;
  std::optional<FrameWriter> shapes_;
  std::optional<v1::EvaluateResponse> evaluation_;
  std::optional<FitReport> fit_;
  BootstrapOutput bootstrap_;
  SolverTally projections_;
  nlohmann::json projection_documents_ = nlohmann::json::array();
};

}  // namespace shaped::shapectl
