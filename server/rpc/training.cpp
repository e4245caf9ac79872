#include "server/rpc/training.h"

#include "core/mesh/quality.h"
#include "core/model/shell_pga_shapes.h"
#include "core/model/shell_pga_training.h"
#include "core/numerics/error.h"
#include "server/convert/model.h"
#include "server/datasets/name.h"
#include "server/errors/errors.h"
#include "server/rpc/body_training.h"
#include "server/rpc/bootstrap_job.h"
#include "server/rpc/job_checkpoint.h"

namespace shaped::server {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kAnyCount = 1'000'000;

ShellPgaTrainingOptions optionsFrom(const v1::ShellPgaTraining& message, const DatasetInfo& dataset) {
  const auto shapes = static_cast<int>(dataset.frames);
  if (shapes < 2)
    throw InvalidInput("dataset", "\"" + dataset.name + "\" holds one shape; training needs at least two");
  ShellPgaTrainingOptions options;
  options.modes = message.modes() == 0 ? std::min(options.modes, shapes - 1)
                                       : countFromProto(message.modes(), kAnyCount, "shell_pga.modes");
  if (message.path_steps() != 0)
    options.path_steps = countFromProto(message.path_steps(), kAnyCount, "shell_pga.path_steps");
  if (message.coarse_vertices() != 0)
    options.coarse_vertices = countFromProto(message.coarse_vertices(), kAnyCount, "shell_pga.coarse_vertices");
  if (message.iterations() != 0)
    options.iterations = countFromProto(message.iterations(), kAnyCount, "shell_pga.iterations");
  if (message.bending() != 0) options.bending = message.bending();
  if (!v1::PathEnergy_IsValid(message.path_energy()))
    throw InvalidInput("shell_pga.path_energy", std::to_string(message.path_energy()) + " is no PathEnergy");
  if (message.path_energy() == v1::PATH_ENERGY_DIRECTED) options.symmetry = EnergySymmetry::kDirected;
  if (message.tolerance() != 0) options.tolerance = message.tolerance();
  if (const auto violation = options.firstViolation(shapes)) throw InvalidInput("shell_pga", *violation);
  return options;
}

Solved<ShellPgaModelPtr> trainResumed(const JobRun& run, const ShellPgaTrainingSet& set,
                                      const ShellPgaTrainingOptions& options, std::chrono::duration<double> every) {
  JobCheckpoint checkpoint(run, every);
  const auto found = checkpoint.find(trainingFingerprint(set, options), readCheckpoint);
  run.resumed(found ? found->stage() : "");
  return trainShellPga(
      set, options, run.progress, run.stop,
      {[&](const auto& state) { checkpoint.offer([&](const auto& path) { writeCheckpoint(path, state()); }); },
       found ? &*found : nullptr});
}

std::string unconvergedText(const Outcome& outcome) {
  return "the training did not converge (" + std::string(name(outcome.termination)) +
         "), so no model was published; ask for it with publish_unconverged, or allow more iterations";
}

JobResult train(const JobContext& context, const JobRun& run) {
  const auto begin = Clock::now();
  const auto request = requestOf<v1::TrainRequest>(run.job);
  const auto options = optionsFrom(request.shell_pga(), context.datasets.get(request.dataset()));
  auto dataset = context.datasets.load(request.dataset());
  const ShellPgaTrainingSet set{dataset.topology, std::move(dataset.shapes), std::move(dataset.template_shape)};
  const auto trained = trainResumed(run, set, options, context.checkpoint_every);
  JobResult result{
      request.model_name(), 0, trained, std::chrono::duration<double>(Clock::now() - begin).count(), 0, {}};
  if (run.stop.stop_requested()) result.outcome.termination = Termination::kCancelled;
  context.metrics.method("Jobs.Train").solved(result.outcome);
  if (result.outcome.termination == Termination::kCancelled) return result;
  if (trained.solution)
    result.smallest_area_ratio = smallestAreaRatio(set.topology->faces(), set.shapes.front(), trained.solution->mean());
  if (!trained.solution || (!trained.converged() && !request.publish_unconverged())) {
    result.failure = unconvergedText(trained);
    return result;
  }
  patiently(context, run, [&] { run.solved(result); });
  auto record = trained.solution->parts().training;
  record.seconds = result.seconds;
  const auto model = std::make_shared<const ShellPgaShapes>(trained.solution->withRecord(record));
  const Provenance provenance{request.dataset(), std::chrono::system_clock::now(), run.job.id, run.job.key};
  patiently(context, run,
            [&] { result.model_version = context.models.publish(request.model_name(), model, provenance)->version; });
  return result;
}

const char* kindOf(const v1::TrainRequest& request) {
  switch (request.method_case()) {
    case v1::TrainRequest::kShellPga:
      return kTrainShellPga;
    case v1::TrainRequest::kBody:
      return kTrainBody;
    case v1::TrainRequest::kBootstrap:
      return kBootstrap;
    case v1::TrainRequest::METHOD_NOT_SET:
      break;
  }
  throw InvalidInput("method", "is missing; want shell_pga, body or bootstrap");
}

/// Checks a request and makes plain what it leaves to the daemon. A repeated one has its answer even if its dataset has
/// been deleted since.
void prepare(const JobContext& context, const std::optional<JobRecord>& known, v1::TrainRequest& request) {
  if (request.has_bootstrap()) return known ? repeatBootstrap(*known, request) : prepareBootstrap(context, request);
  if (known) return;
  const auto dataset = context.datasets.get(request.dataset());
  if (request.has_body())
    requireTrainable(request.body(), dataset);
  else
    optionsFrom(request.shell_pga(), dataset);
}

}  // namespace

JobKind shellPgaTraining(const JobContext& context) {
  return {[&context](const JobRun& run) { return train(context, run); },
          [&context](const JobRecord& job) { return context.models.publishedBy(job.model_name, job.key); }};
}

JobRecord startTraining(const JobDesk& desk, v1::TrainRequest request) {
  const auto known = earlierJob(desk, request.request_id());
  requireName(request.model_name(), "model_name");
  const auto* kind = kindOf(request);
  prepare(desk.context, known, request);
  auto wanted = newJob(kind, request.SerializeAsString(), request.request_id());
  wanted.model_name = request.model_name();
  wanted.dataset = request.dataset();
  return desk.runner.start(std::move(wanted));
}

}  // namespace shaped::server
