#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "client/shapectl/exit_code.h"
#include "client/shapectl/progress_bar.h"
#include "client/shapectl/session.h"
#include "shaped/v1/jobs.pb.h"

namespace shaped::shapectl {

/// "queued", "running", "succeeded", ...
std::string nameOf(v1::JobState state);
nlohmann::json toJson(const v1::Job& job);
/// One line for people.
std::string jobText(const v1::Job& job);
/// Draws a job's progress.
void show(ProgressBar& bar, const v1::Job& job);
/// Prints a job that goes on without us.
ExitCode printStarted(const v1::Job& job, const Session& session);
/// Prints a job that has ended and returns how it ended.
ExitCode printEnded(const v1::Job& job, const Session& session);

}  // namespace shaped::shapectl
