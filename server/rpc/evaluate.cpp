#include "server/rpc/evaluate.h"

#include "core/mesh/quality.h"
#include "core/model/shell_pga_evaluation.h"
#include "core/numerics/error.h"
#include "server/convert/model.h"
#include "server/jobs/arena.h"
#include "server/rpc/answer.h"

namespace shaped::server {
namespace {

constexpr int kMostSamples = 10000;

Dataset datasetFor(const ServedModel& model, DatasetStore& datasets, const std::string& wanted) {
  const auto name = wanted.empty() ? provenanceOf(model.manifest).dataset : wanted;
  if (name.empty()) throw InvalidInput("dataset", "is missing, and the model does not say what it was trained on");
  auto dataset = datasets.load(name);
  if (dataset.topology->id() != model.shell_pga->topology().id())
    throw InvalidInput("dataset", "\"" + name + "\" has another connectivity than the model");
  return dataset;
}

EvaluationOptions optionsFrom(const v1::EvaluateRequest& request, const ShellPgaModel& model, const Call& call) {
  EvaluationOptions options;
  for (int i = 0; i < request.modes_size(); ++i)
    options.modes.push_back(countFromProto(request.modes(i), model.modes(), "modes[" + std::to_string(i) + "]"));
  options.folds = countFromProto(request.folds(), std::numeric_limits<int>::max(), "folds");
  if (request.has_specificity_samples())
    options.specificity_samples = countFromProto(request.specificity_samples(), kMostSamples, "specificity_samples");
  options.seed = request.seed();
  options.stop = call.stopToken();
  return options;
}

void toProto(const std::vector<GeneralisationError>& errors, v1::GeneralisationError& message) {
  for (const auto& error : errors) {
    message.add_elastic(error.elastic);
    message.add_vertex(error.vertex);
  }
}

}  // namespace

void evaluate(ModelStore& models, DatasetStore& datasets, int threads, const v1::EvaluateRequest& request,
              v1::EvaluateResponse& response, Call& call) {
  const auto served = pinModel(models, request, call);
  const auto& model = *served->shell_pga;
  const auto dataset = datasetFor(*served, datasets, request.dataset());
  const auto options = optionsFrom(request, model, call);
  Solved<ShellPgaEvaluation> solved;
  runInArena(threads, [&] { solved = evaluate(model, dataset.shapes, options, {}); });
  const auto& faces = model.topology().faces();
  setAnswer(*served, solved, smallestAreaRatio(faces, dataset.shapes.front(), model.mean()), call, response);
  const auto& evaluation = solved.solution;
  response.mutable_modes()->Add(evaluation.modes.begin(), evaluation.modes.end());
  response.mutable_compactness()->Add(evaluation.compactness.begin(), evaluation.compactness.end());
  toProto(evaluation.generalisation, *response.mutable_generalisation());
  toProto(evaluation.linear, *response.mutable_linear_generalisation());
  response.mutable_specificity()->Add(evaluation.specificity.begin(), evaluation.specificity.end());
}

}  // namespace shaped::server
