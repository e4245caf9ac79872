#pragma once

#include <google/protobuf/timestamp.pb.h>

#include <nlohmann/json.hpp>
#include <string>

#include "client/shapectl/exit_code.h"
#include "shaped/v1/model.pb.h"
#include "shaped/v1/report.pb.h"

namespace shaped::shapectl {

/// Prints a document to stdout, indented, with a line end. Numbers that are not finite become null.
void printJson(const nlohmann::json& document);

/// "converged", "iteration_limit", ...
std::string nameOf(v1::Termination termination);
/// "2026-11-22T06:00:36Z"; empty when the time is not set.
std::string timeText(const google::protobuf::Timestamp& time);
/// "NAME@VERSION"; empty when there is no model.
std::string modelText(const v1::ModelVersion& model);

/// Adds what every answer carries: termination, iterations, residual, seconds.
void addReport(nlohmann::json& document, const v1::SolverReport& report);
/// Adds "model": {"name", "version"}.
void addModel(nlohmann::json& document, const v1::ModelVersion& model);
/// "converged after 12 iterations, residual 3.1e-09, 0.42 s".
std::string reportText(const v1::SolverReport& report);

/// Success when the solver converged, kNotConverged otherwise.
ExitCode exitCodeOf(const v1::SolverReport& report);

/// NAME, NAME@VERSION or NAME@LABEL from the command line. Throws InvalidInput when nothing or 0 follows the @.
v1::ModelSelector parseModel(const std::string& text);

}  // namespace shaped::shapectl
