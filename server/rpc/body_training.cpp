#include "server/rpc/body_training.h"

#include "core/body/body_training.h"
#include "core/io/rig_file.h"
#include "core/mesh/quality.h"
#include "core/model/body_shapes.h"
#include "core/numerics/error.h"
#include "server/convert/model.h"

namespace shaped::server {
namespace {

using Clock = std::chrono::steady_clock;

BodyTrainingOptions optionsFrom(const v1::BodyTraining& message, const DatasetInfo& dataset) {
  if (dataset.frames < 2)
    throw InvalidInput("dataset", "\"" + dataset.name + "\" holds one shape; training needs at least two");
  BodyTrainingOptions options;
  options.posture = postureFromProto(message.posture(), "body.posture");
  options.modes = countFromProto(message.modes(), static_cast<int>(dataset.frames) - 1, "body.modes");
  if (message.explained() != 0) options.explained = message.explained();
  if (message.reach() != 0) options.reach = message.reach();
  if (const auto violation = options.firstViolation()) throw InvalidInput("body", *violation);
  return options;
}

std::optional<Rig> rigFrom(const v1::BodyTraining& message, std::int32_t vertex_count) {
  if (message.rig().empty()) return std::nullopt;
  return parseRig("body.rig", message.rig(), vertex_count).rig;
}

PostureTemplate templateOf(const Dataset& dataset, const v1::BodyTraining& message) {
  const auto& rest = dataset.template_shape ? *dataset.template_shape : dataset.shapes.front();
  auto rig = rigFrom(message, dataset.topology->vertexCount());
  return makePostureTemplate(dataset.topology, rest, rig ? std::move(*rig) : rigidRig(rest));
}

JobResult train(const JobContext& context, const JobRun& run) {
  const auto begin = Clock::now();
  const auto request = requestOf<v1::TrainRequest>(run.job);
  auto options = optionsFrom(request.body(), context.datasets.get(request.dataset()));
  options.stop = run.stop;
  options.progress = run.progress;
  run.resumed("");
  const auto dataset = context.datasets.load(request.dataset());
  auto trained = trainBody(templateOf(dataset, request.body()), dataset.shapes, options);
  JobResult result{request.model_name(), 0, {}, std::chrono::duration<double>(Clock::now() - begin).count(), 0, {}};
  result.outcome.termination = trained ? Termination::kConverged : Termination::kCancelled;
  context.metrics.method("Jobs.Train").solved(result.outcome);
  if (!trained) return result;
  const auto model = std::make_shared<const BodyShapes>(
      std::move(trained->model), BodyTrainingRecord{static_cast<int>(dataset.shapes.size()), options.posture,
                                                    options.reach, std::move(trained->variances), result.seconds});
  result.smallest_area_ratio = smallestAreaRatio(dataset.topology->faces(), dataset.shapes.front(), model->mean());
  patiently(context, run, [&] { run.solved(result); });
  const Provenance provenance{request.dataset(), std::chrono::system_clock::now(), run.job.id, run.job.key};
  patiently(context, run,
            [&] { result.model_version = context.models.publish(request.model_name(), model, provenance)->version; });
  return result;
}

}  // namespace

JobKind bodyTraining(const JobContext& context) {
  return {[&context](const JobRun& run) { return train(context, run); },
          [&context](const JobRecord& job) { return context.models.publishedBy(job.model_name, job.key); }};
}

void requireTrainable(const v1::BodyTraining& message, const DatasetInfo& dataset) {
  optionsFrom(message, dataset);
  rigFrom(message, static_cast<std::int32_t>(dataset.vertex_count));
}

}  // namespace shaped::server
