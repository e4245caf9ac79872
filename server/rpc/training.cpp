#include "server/rpc/training.h"

#include "core/mesh/quality.h"
#include "core/model/shell_pga_shapes.h"
#include "core/model/shell_pga_training.h"
#include "core/numerics/error.h"
#include "server/convert/model.h"
#include "server/datasets/name.h"
#include "server/errors/errors.h"
#include "server/rpc/body_training.h"
#include "server/telemetry/call_log.h"

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

/// The checkpoint of one training job: found where an earlier process left it, written as time goes by.
class TrainingCheckpoint {
 public:
  TrainingCheckpoint(const JobRun& run, std::chrono::duration<double> every)
      : run_(run), path_(run.folder / "checkpoint.safetensors"), every_(every) {}

  /// What is there and of this training; a damaged or foreign one is told in the log and left aside.
  std::optional<ShellPgaCheckpoint> find(const std::string& training) const {
    if (!std::filesystem::exists(path_)) return std::nullopt;
    try {
      auto checkpoint = readCheckpoint(path_);
      if (checkpoint.training == training) return checkpoint;
      logError("job " + run_.job.id + " begins anew: " + path_.string() + " is of another training");
    } catch (const std::exception& problem) {
      logError("job " + run_.job.id + " begins anew: " + problem.what());
    }
    return std::nullopt;
  }

  /// Keeps the state when the last one is old, or the job is to stop. A disk that takes none does not end the training.
  void offer(const std::function<ShellPgaCheckpoint()>& state) {
    if (Clock::now() - kept_ < every_ && !run_.stop.stop_requested()) return;
    kept_ = Clock::now();
    try {
      writeCheckpoint(path_, state());
      run_.checkpointed();
    } catch (const std::exception& problem) {
      logError("job " + run_.job.id + " goes on without a checkpoint: " + problem.what());
    }
  }

 private:
  const JobRun& run_;
  const std::filesystem::path path_;
  const std::chrono::duration<double> every_;
  Clock::time_point kept_ = Clock::now();
};

Solved<ShellPgaModelPtr> trainResumed(const JobRun& run, const ShellPgaTrainingSet& set,
                                      const ShellPgaTrainingOptions& options, std::chrono::duration<double> every) {
  TrainingCheckpoint checkpoint(run, every);
  const auto found = checkpoint.find(trainingFingerprint(set, options));
  run.resumed(found ? found->stage() : "");
  return trainShellPga(set, options, run.progress, run.stop,
                       {[&](const auto& state) { checkpoint.offer(state); }, found ? &*found : nullptr});
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
    case v1::TrainRequest::METHOD_NOT_SET:
      break;
  }
  throw InvalidInput("method", "is missing; want shell_pga or body");
}

void requireTrainable(const v1::TrainRequest& request, const DatasetInfo& dataset) {
  request.has_body() ? server::requireTrainable(request.body(), dataset)
                     : static_cast<void>(optionsFrom(request.shell_pga(), dataset));
}

}  // namespace

JobKind shellPgaTraining(const JobContext& context) {
  return {[&context](const JobRun& run) { return train(context, run); },
          [&context](const JobRecord& job) { return context.models.publishedBy(job.model_name, job.key); }};
}

JobRecord startTraining(const JobDesk& desk, const v1::TrainRequest& request) {
  const auto known = earlierJob(desk, request.request_id());
  requireName(request.model_name(), "model_name");
  const auto* kind = kindOf(request);
  // A repeated request has its answer even if its dataset has been deleted since.
  if (!known) requireTrainable(request, desk.context.datasets.get(request.dataset()));
  auto wanted = newJob(kind, request.SerializeAsString(), request.request_id());
  wanted.model_name = request.model_name();
  wanted.dataset = request.dataset();
  return desk.runner.start(std::move(wanted));
}

}  // namespace shaped::server
