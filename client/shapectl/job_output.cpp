#include "client/shapectl/job_output.h"

#include <algorithm>
#include <iostream>
#include <sstream>

#include "client/shapectl/failure.h"
#include "client/shapectl/output.h"

namespace shaped::shapectl {
namespace {

ExitCode endOf(const v1::Job& job) {
  if (job.state() == v1::JOB_STATE_CANCELLED) return ExitCode::kCancelled;
  // A job that failed for another reason than its solver, say a full disk, may have a converged report.
  const bool by_solver = job.state() == v1::JOB_STATE_SUCCEEDED || job.error_code() == grpc::FAILED_PRECONDITION;
  if (by_solver && job.has_report()) return exitCodeOf(job.report());
  return exitCodeOf(static_cast<grpc::StatusCode>(job.error_code()));
}

}  // namespace

std::string nameOf(v1::JobState state) {
  constexpr std::string_view prefix = "JOB_STATE_";
  std::string name = v1::JobState_Name(state).substr(prefix.size());
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  return name;
}

nlohmann::json toJson(const v1::Job& job) {
  nlohmann::json document{{"id", job.id()},
                          {"kind", job.kind()},
                          {"state", nameOf(job.state())},
                          {"model_name", job.model_name()},
                          {"dataset", job.dataset()},
                          {"stage", job.stage()},
                          {"fraction", job.fraction()},
                          {"stage_residual", job.residual()},
                          {"attempts", job.attempts()},
                          {"cancel_requested", job.cancel_requested()},
                          {"created", timeText(job.created())},
                          {"started", timeText(job.started())},
                          {"ended", timeText(job.ended())}};
  if (!job.resumed_from().empty()) document["resumed_from"] = job.resumed_from();
  if (!job.request_id().empty()) document["request_id"] = job.request_id();
  if (job.has_report()) {
    addReport(document, job.report());
    document["smallest_area_ratio"] = job.smallest_area_ratio();
  }
  if (job.has_model()) addModel(document, job.model());
  if (!job.error().empty()) document["error"] = {{"message", job.error()}, {"code", job.error_code()}};
  return document;
}

std::string jobText(const v1::Job& job) {
  std::ostringstream text;
  text << job.id() << "  " << nameOf(job.state()) << "  " << job.kind() << "  " << job.model_name() << "  "
       << static_cast<int>(100 * job.fraction()) << " %";
  if (job.has_model()) text << "  " << modelText(job.model());
  if (job.has_report()) text << "  " << reportText(job.report());
  if (!job.error().empty()) text << "  " << job.error();
  if (job.attempts() > 1) text << "  attempt " << job.attempts();
  if (job.state() == v1::JOB_STATE_RUNNING) text << "  " << job.stage();
  if (job.state() == v1::JOB_STATE_RUNNING && job.cancel_requested()) text << "  (asked to stop)";
  return text.str();
}

void show(ProgressBar& bar, const v1::Job& job) {
  std::ostringstream text;
  text << (job.state() == v1::JOB_STATE_QUEUED ? "waiting for another job" : job.stage());
  if (job.residual() > 0) text << ", residual " << job.residual();
  bar.show(job.fraction(), text.str());
}

ExitCode printStarted(const v1::Job& job, const Session& session) {
  if (session.json)
    printJson(toJson(job));
  else
    std::cout << jobText(job) << "\n";
  return ExitCode::kSuccess;
}

ExitCode printEnded(const v1::Job& job, const Session& session) {
  if (session.json)
    printJson(toJson(job));
  else
    std::cout << jobText(job) << "\n";
  return endOf(job);
}

}  // namespace shaped::shapectl
