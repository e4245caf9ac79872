#include "server/rpc/training.h"

#include <condition_variable>
#include <mutex>

#include "core/io/file_error.h"
#include "core/mesh/quality.h"
#include "core/model/shell_pga_training.h"
#include "core/numerics/error.h"
#include "server/convert/model.h"
#include "server/datasets/name.h"
#include "server/errors/errors.h"
#include "server/errors/status.h"

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

/// False when the token fired first.
bool sleepUnlessStopped(Clock::duration time, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any wake;
  std::unique_lock lock(mutex);
  return !wake.wait_for(lock, stop, time, [] { return false; }) && !stop.stop_requested();
}

/// A full disk must not cost hours of training: try again until there is room, the patience ends or the job is stopped.
ServedModelPtr publishPatiently(const TrainingContext& context, const std::string& name, const ShellPgaModelPtr& model,
                                const Provenance& provenance, const ProgressSink& progress,
                                const std::stop_token& stop) {
  const auto until = Clock::now() + std::chrono::duration_cast<Clock::duration>(context.publish_patience);
  while (true) try {
      return context.models.publish(name, model, provenance);
    } catch (const FileError& error) {
      if (!saysDiskFull(error.what()) || Clock::now() >= until) throw;
      progress({std::string("waiting for room on the disk: ") + error.what(), 1, 0});
      if (!sleepUnlessStopped(std::chrono::seconds(2), stop)) throw Stopped();
    }
}

ShellPgaModelPtr withSeconds(const ShellPgaModel& model, double seconds) {
  auto parts = model.parts();
  parts.training.seconds = seconds;
  return std::make_shared<const ShellPgaModel>(std::move(parts));
}

JobResult train(const TrainingContext& context, const v1::TrainRequest& request, const ShellPgaTrainingOptions& options,
                const ProgressSink& progress, const std::stop_token& stop) {
  const auto begin = Clock::now();
  auto dataset = context.datasets.load(request.dataset());
  const ShellPgaTrainingSet set{dataset.topology, std::move(dataset.shapes), std::move(dataset.template_shape)};
  const auto trained = trainShellPga(set, options, progress, stop);
  JobResult result{request.model_name(), 0, trained, std::chrono::duration<double>(Clock::now() - begin).count(), 0};
  if (stop.stop_requested()) result.outcome.termination = Termination::kCancelled;
  if (!trained.solution || result.outcome.termination == Termination::kCancelled) return result;
  result.smallest_area_ratio = smallestAreaRatio(set.topology->faces(), set.shapes.front(), trained.solution->mean());
  if (!trained.converged() && !request.publish_unconverged()) return result;
  const Provenance provenance{request.dataset(), std::chrono::system_clock::now()};
  const auto model = withSeconds(*trained.solution, result.seconds);
  result.model_version = publishPatiently(context, request.model_name(), model, provenance, progress, stop)->version;
  return result;
}

}  // namespace

JobRecord startTraining(const TrainingContext& context, const v1::TrainRequest& request) {
  requireName(request.model_name(), "model_name");
  if (!request.has_shell_pga()) throw InvalidInput("method", "is missing; want shell_pga");
  const auto options = optionsFrom(request.shell_pga(), context.datasets.get(request.dataset()));
  return context.runner.start(request.model_name(), request.dataset(),
                              [context, request, options](const ProgressSink& progress, std::stop_token stop) {
                                return train(context, request, options, progress, stop);
                              });
}

}  // namespace shaped::server
