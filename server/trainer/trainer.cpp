#include "server/trainer/trainer.h"

#include <tbb/global_control.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "core/io/tensor_file.h"
#include "core/neural/jacobian_field_file.h"
#include "core/numerics/error.h"
#include "core/training/field_checkpoint.h"
#include "server/trainer/job_inputs.h"

namespace shaped::server {
namespace {

using nlohmann::json;
using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// Where training goes on: at the folder's checkpoint, or at the beginning.
FieldTrainingState startOf(const std::filesystem::path& checkpoint, const JobSpec& spec, const JobInputs& inputs,
                           const std::string& training) {
  if (!std::filesystem::exists(checkpoint))
    return untrainedState(untrainedField(inputs.scaling, spec.architecture, spec.options.seed));
  auto [state, written_for] = readFieldCheckpoint(checkpoint);
  if (written_for != training)
    throw InvalidInput(checkpoint.string(), "is of another training or of other inputs; remove it to begin anew");
  return state;
}

void writeField(const std::filesystem::path& path, const JacobianFieldWeights& weights) {
  TensorWriter file;
  addJacobianField("field", weights, file);
  file.write(path);
}

class Trainer {
 public:
  Trainer(const std::filesystem::path& folder, const std::function<void(const json&)>& tell, std::stop_token stop)
      : folder_(folder), tell_(tell), stop_(std::move(stop)), spec_(readJobSpec(folder)) {}

  JobEnd run() {
    const tbb::global_control threads(tbb::global_control::max_allowed_parallelism,
                                      static_cast<std::size_t>(spec_.threads));
    const auto inputs = readJobInputs(folder_, spec_, stop_);
    if (!inputs) return end(JobEnd::kStopped, "stopped", 0);
    training_ = spec_.training() + " " + inputs->sha256;
    auto state = startOf(checkpointFile(), spec_, *inputs, training_);
    tell_({{"event", "start"},
           {"pairs", inputs->pairs.size()},
           {"parameters", parametersOf(state.weights).size()},
           {"step", state.step}});
    return finish(trainJacobianField(inputs->pairs, std::move(state), options()));
  }

 private:
  std::filesystem::path checkpointFile() const { return folder_ / "checkpoint.safetensors"; }

  FieldTrainingOptions options() {
    auto options = spec_.options;
    options.stop = stop_;
    options.each_epoch = [this](const FieldEpoch& epoch, const FieldTrainingState& state) {
      tell_({{"event", "epoch"},
             {"epoch", epoch.epoch},
             {"epochs", spec_.options.epochs},
             {"loss", epoch.loss.total},
             {"vertex", epoch.loss.vertex},
             {"jacobian", epoch.loss.jacobian},
             {"learning_rate", epoch.learning_rate},
             {"seconds", secondsSince(start_)}});
      if (secondsSince(last_checkpoint_) >= spec_.checkpoint_seconds) writeCheckpoint(state);
    };
    return options;
  }

  void writeCheckpoint(const FieldTrainingState& state) {
    writeFieldCheckpoint(checkpointFile(), state, training_);
    last_checkpoint_ = Clock::now();
    tell_({{"event", "checkpoint"}, {"step", state.step}});
  }

  JobEnd finish(const Solved<FieldTrainingState>& trained) {
    if (trained.termination == Termination::kNumericalFailure)
      return end(JobEnd::kDiverged, "diverged", trained.iterations);
    writeCheckpoint(trained.solution);
    if (trained.termination == Termination::kCancelled) return end(JobEnd::kStopped, "stopped", trained.iterations);
    writeField(folder_ / "field.safetensors", trained.solution.weights);
    return end(JobEnd::kDone, "done", trained.iterations);
  }

  JobEnd end(JobEnd how, const char* event, int step) {
    tell_({{"event", event}, {"step", step}});
    return how;
  }

  std::filesystem::path folder_;
  const std::function<void(const json&)>& tell_;
  std::stop_token stop_;
  JobSpec spec_;
  std::string training_;
  Clock::time_point start_ = Clock::now(), last_checkpoint_ = start_;
};

}  // namespace

JobEnd train(const std::filesystem::path& folder, const std::function<void(const json&)>& tell,
             const std::stop_token& stop) {
  return Trainer(folder, tell, stop).run();
}

}  // namespace shaped::server
