#include "server/rpc/evaluate.h"

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "server/convert/model.h"
#include "server/jobs/arena.h"
#include "server/models/kind.h"
#include "server/rpc/answer.h"
#include "server/rpc/batch_result.h"

namespace shaped::server {
namespace {

constexpr int kMostSamples = 10000;
constexpr const char* kEvaluation = "an evaluation";

/// The dataset that is asked for, or the model's own.
DatasetInfo datasetInfoFor(const ServedModel& model, const DatasetStore& datasets, const std::string& wanted) {
  const auto name = wanted.empty() ? provenanceOf(model.manifest).dataset : wanted;
  if (name.empty()) throw InvalidInput("dataset", "is missing, and the model does not say what it was trained on");
  auto info = datasets.get(name);
  requireConnectivity(model, info);
  return info;
}

EvaluationOptions optionsFrom(const v1::EvaluateRequest& request, const ShellPgaModel& model, std::stop_token stop) {
  EvaluationOptions options;
  for (int i = 0; i < request.modes_size(); ++i)
    options.modes.push_back(countFromProto(request.modes(i), model.modes(), "modes[" + std::to_string(i) + "]"));
  options.folds = countFromProto(request.folds(), std::numeric_limits<int>::max(), "folds");
  if (request.has_specificity_samples())
    options.specificity_samples = countFromProto(request.specificity_samples(), kMostSamples, "specificity_samples");
  options.seed = request.seed();
  options.stop = std::move(stop);
  return options;
}

void toProto(const std::vector<GeneralisationError>& errors, v1::GeneralisationError& message) {
  for (const auto& error : errors) {
    message.add_elastic(error.elastic);
    message.add_vertex(error.vertex);
  }
}

void fill(const ShellPgaEvaluation& evaluation, v1::EvaluateResponse& response) {
  response.mutable_modes()->Add(evaluation.modes.begin(), evaluation.modes.end());
  response.mutable_compactness()->Add(evaluation.compactness.begin(), evaluation.compactness.end());
  toProto(evaluation.generalisation, *response.mutable_generalisation());
  toProto(evaluation.linear, *response.mutable_linear_generalisation());
  response.mutable_specificity()->Add(evaluation.specificity.begin(), evaluation.specificity.end());
}

/// Of the model's mean against the first shape.
double areaRatio(const ShellPgaModel& model, const Dataset& dataset) {
  return smallestAreaRatio(model.topology().faces(), dataset.shapes.front(), model.mean());
}

JobResult run(const JobContext& context, const JobRun& run) {
  const auto request = requestOf<v1::EvaluateJobRequest>(run.job).evaluate();
  const auto served = pinForJob(context, run, request.model());
  const auto& model = shellPgaFor(kEvaluation, *served);
  const auto dataset = context.datasets.load(datasetInfoFor(*served, context.datasets, request.dataset()).name);
  BatchResult result(context, run, "Jobs.Evaluate", fingerprintOf(dataset));
  result.open(0);
  const auto from = result.find(&readEvaluationState);
  run.resumed(from ? from->stage() : "");
  const auto begin = std::chrono::steady_clock::now();
  const ShellPgaEvaluationResumption resumption{
      [&](const auto& state) { result.offer([&](const auto& path) { writeEvaluationState(path, state); }); },
      from ? &*from : nullptr};
  const auto solved = evaluate(model, dataset.shapes, optionsFrom(request, model, run.stop), run.progress, resumption);
  if (solved.termination == Termination::kCancelled) return result.stopped();
  v1::GetJobResultResponse answer;
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
  fillAnswer(*served, solved, seconds.count(), areaRatio(model, dataset), *answer.mutable_evaluate());
  fill(solved.solution, *answer.mutable_evaluate());
  result.add(answer);
  return result.finish();
}

}  // namespace

void evaluate(ModelStore& models, DatasetStore& datasets, int threads, const v1::EvaluateRequest& request,
              v1::EvaluateResponse& response, Call& call) {
  const auto served = pinModel(models, request, call);
  const auto& model = shellPgaFor(kEvaluation, *served);
  const auto dataset = datasets.load(datasetInfoFor(*served, datasets, request.dataset()).name);
  const auto options = optionsFrom(request, model, call.stopToken());
  Solved<ShellPgaEvaluation> solved;
  runInBackground(threads, [&] { solved = evaluate(model, dataset.shapes, options, {}); });
  setAnswer(*served, solved, areaRatio(model, dataset), call, response);
  fill(solved.solution, response);
}

JobKind evaluation(const JobContext& context) {
  return {.work = [&context](const JobRun& one) { return run(context, one); }};
}

JobRecord startEvaluation(const JobDesk& desk, v1::EvaluateJobRequest request, Call& call) {
  auto& wanted = *request.mutable_evaluate();
  if (const auto known = earlierJob(desk, request.request_id())) {
    if (known->kind == kEvaluate) {
      const auto before = requestOf<v1::EvaluateJobRequest>(*known).evaluate();
      repeatVersion(before.model(), *wanted.mutable_model());
      if (wanted.dataset().empty()) wanted.set_dataset(before.dataset());
    }
  } else {
    const auto served = pinModel(desk.context.models, wanted, call);
    const auto info = datasetInfoFor(*served, desk.context.datasets, wanted.dataset());
    const auto& model = shellPgaFor(kEvaluation, *served);
    requireEvaluable(model, static_cast<std::size_t>(info.frames), optionsFrom(wanted, model, {}));
    nameVersion(*served, *wanted.mutable_model());
    wanted.set_dataset(info.name);
  }
  auto job = newJob(kEvaluate, request.SerializeAsString(), request.request_id());
  job.model_name = textOf(wanted.model());
  job.dataset = wanted.dataset();
  return desk.runner.start(std::move(job));
}

}  // namespace shaped::server
