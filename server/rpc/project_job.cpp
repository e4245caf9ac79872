#include "server/rpc/project_job.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "core/numerics/error.h"
#include "server/convert/model.h"
#include "server/rpc/answer.h"
#include "server/rpc/batch_result.h"
#include "server/rpc/shape_handlers.h"

namespace shaped::server {
namespace {

ProjectionOptions optionsFrom(const v1::ProjectJobRequest& request, const ShapeModel& model, std::stop_token stop) {
  return {.modes = countFromProto(request.modes(), model.modes(), "modes"),
          .fine = request.fine(),
          .stop = std::move(stop)};
}

/// The shapes from `first` on, side by side in the job's arena; fewer at the end.
std::vector<v1::GetJobResultResponse> answersFrom(std::size_t first, const ServedModel& served, const Dataset& dataset,
                                                  const v1::ProjectJobRequest& request, const JobRun& run) {
  const auto together = 2 * static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
  std::vector<v1::GetJobResultResponse> answers(std::min(together, dataset.shapes.size() - first));
  const auto options = optionsFrom(request, *served.shapes, run.stop);
  tbb::parallel_for(std::size_t{0}, answers.size(), [&](std::size_t i) {
    const auto begin = std::chrono::steady_clock::now();
    const auto solved = served.shapes->project(dataset.shapes[first + i], options);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    auto& response = *answers[i].mutable_project();
    fillAnswer(served, solved, seconds.count(), solved.solution.smallest_area_ratio, response);
    fill(served, solved.solution, !request.without_shapes(), response);
  });
  return answers;
}

JobResult run(const JobContext& context, const JobRun& run) {
  const auto request = requestOf<v1::ProjectJobRequest>(run.job);
  const auto served = pinForJob(context, run, request.model());
  const auto dataset = context.datasets.load(request.dataset());
  requireConnectivity(*served, context.datasets.get(request.dataset()));
  BatchResult result(context, run, "Jobs.Project", fingerprintOf(dataset));
  result.open(RecordWriter::kAll);
  const auto total = dataset.shapes.size();
  run.resumed(result.count() > 0 ? "shape " + std::to_string(result.count()) : "");
  for (auto done = static_cast<std::size_t>(result.count()); done < total;) {
    run.progress({"shape " + std::to_string(done + 1) + " of " + std::to_string(total),
                  static_cast<double>(done) / static_cast<double>(total), 0});
    const auto answers = answersFrom(done, *served, dataset, request, run);
    if (run.stop.stop_requested()) break;  // what a stopped solver says is no answer
    for (const auto& answer : answers) result.add(answer);
    done += answers.size();
    result.offer();
  }
  if (!run.stop.stop_requested()) return result.finish();
  result.offer();
  return result.stopped();
}

}  // namespace

JobKind projection(const JobContext& context) {
  return {.work = [&context](const JobRun& one) { return run(context, one); }};
}

JobRecord startProjection(const JobDesk& desk, v1::ProjectJobRequest request, Call& call) {
  if (const auto known = earlierJob(desk, request.request_id())) {
    if (known->kind == kProject)
      repeatVersion(requestOf<v1::ProjectJobRequest>(*known).model(), *request.mutable_model());
  } else {
    const auto served = pinModel(desk.context.models, request, call);
    requireConnectivity(*served, desk.context.datasets.get(request.dataset()));
    optionsFrom(request, *served->shapes, {});
    nameVersion(*served, *request.mutable_model());
  }
  auto job = newJob(kProject, request.SerializeAsString(), request.request_id());
  job.model_name = textOf(request.model());
  job.dataset = request.dataset();
  return desk.runner.start(std::move(job));
}

}  // namespace shaped::server
