#include "core/training/field_training.h"

#include <ATen/CPUGeneratorImpl.h>
#include <ATen/Context.h>
#include <ATen/Parallel.h>
#include <tbb/parallel_for.h>
#include <torch/csrc/autograd/autograd.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/numerics/error.h"
#include "core/numerics/threads.h"
#include "core/training/field_loss.h"
#include "core/training/tensors.h"

namespace shaped {
namespace {

constexpr double kFirstDecay = 0.9, kSecondDecay = 0.999, kAdamFloor = 1e-8;

/// Parallelism is over pairs; with one thread inside each, sums are taken in the same order everywhere.
void makeTorchDeterministic() {
  at::set_num_threads(1);
  at::globalContext().setDeterministicAlgorithms(true, /*warn_only=*/false);
}

/// The order of the pairs in an epoch: its own sequence, so that it does not depend on where training was resumed.
std::vector<std::int64_t> orderOf(std::int64_t epoch, std::int64_t pairs, std::uint64_t seed) {
  const auto random =
      at::detail::createCPUGenerator(seed + 0x9e3779b97f4a7c15ULL * static_cast<std::uint64_t>(epoch + 1));
  const auto order = torch::randperm(pairs, random, torch::kInt64);
  return {order.data_ptr<std::int64_t>(), order.data_ptr<std::int64_t>() + pairs};
}

struct PairGradient {
  FieldLoss loss;
  torch::Tensor gradient;  ///< undefined when stopped before
};

class FieldTrainer {
 public:
  FieldTrainer(const std::vector<FieldPair>& pairs, FieldTrainingState state, const FieldTrainingOptions& options)
      : network_(state.weights),
        options_(options),
        parameters_(tensorOf(parametersOf(state.weights)).view(-1)),
        first_(tensorOf(state.first).view(-1)),
        second_(tensorOf(state.second).view(-1)),
        state_(std::move(state)) {
    for (const auto& pair : pairs) pairs_.push_back(tensorsOf(pair, torch::kFloat32));
  }

  Solved<FieldTrainingState> run() {
    const auto last = std::int64_t{options_.epochs} * stepsPerEpoch();
    while (state_.step < last) {
      const auto ended = step();
      if (ended) return answer(*ended);
      if (state_.step % stepsPerEpoch() == 0) endEpoch();
    }
    return answer(Termination::kIterationLimit);
  }

 private:
  std::int64_t stepsPerEpoch() const { return (std::ssize(pairs_) + options_.batch - 1) / options_.batch; }

  double learningRate() const {
    const auto last = std::int64_t{options_.epochs} * stepsPerEpoch() - 1;
    const double passed = last > 0 ? static_cast<double>(state_.step) / static_cast<double>(last) : 0;
    const double rise = std::min(1.0, static_cast<double>(state_.step + 1) / (options_.warm_up + 1.0));
    return rise * options_.learning_rate * std::pow(options_.last_learning_rate / options_.learning_rate, passed);
  }

  /// The pairs of the step that comes.
  std::vector<std::int64_t> batch() const {
    const auto order = orderOf(state_.step / stepsPerEpoch(), std::ssize(pairs_), options_.seed);
    const auto begin = state_.step % stepsPerEpoch() * options_.batch;
    return {order.begin() + begin, order.begin() + std::min(begin + options_.batch, std::ssize(order))};
  }

  PairGradient gradientOf(const FieldPairTensors& pair) const {
    if (options_.stop.stop_requested()) return {};
    limitOpenMpInThisThread();
    const auto parameters = parameters_.detach().requires_grad_();
    const auto [vertex, jacobian] = fieldLoss(network_(parameters, pair.features), pair);
    const auto total = options_.vertex_weight * vertex + options_.jacobian_weight * jacobian;
    const FieldLoss loss{total.item<double>(), vertex.item<double>(), jacobian.item<double>()};
    if (options_.stop.stop_requested()) return {};
    return {loss, torch::autograd::grad({total}, {parameters}).front()};
  }

  std::vector<PairGradient> gradients() const {
    const auto chosen = batch();
    std::vector<PairGradient> answers(chosen.size());
    tbb::parallel_for(std::size_t{0}, chosen.size(),
                      [&](std::size_t i) { answers[i] = gradientOf(pairs_[static_cast<std::size_t>(chosen[i])]); });
    return answers;
  }

  /// Nothing, or why no step was taken.
  std::optional<Termination> step() {
    const auto parts = gradients();
    FieldLoss loss;
    auto gradient = torch::zeros_like(parameters_);
    for (const auto& part : parts) {
      if (!part.gradient.defined()) return Termination::kCancelled;
      gradient += part.gradient / static_cast<double>(parts.size());
      loss += part.loss;
    }
    if (!std::isfinite(loss.total) || !gradient.isfinite().all().item<bool>()) return Termination::kNumericalFailure;
    learning_rate_ = learningRate();
    descend(gradient);
    ++state_.step;
    state_.epoch_loss += loss;
    return std::nullopt;
  }

  /// One step of Adam.
  void descend(const torch::Tensor& gradient) {
    const auto count = static_cast<double>(state_.step + 1);
    first_ = kFirstDecay * first_ + (1 - kFirstDecay) * gradient;
    second_ = kSecondDecay * second_ + (1 - kSecondDecay) * gradient.square();
    const double first_bias = 1 - std::pow(kFirstDecay, count), second_bias = 1 - std::pow(kSecondDecay, count);
    parameters_ = parameters_ - learning_rate_ / first_bias * first_ / ((second_ / second_bias).sqrt() + kAdamFloor);
  }

  void endEpoch() {
    const auto pairs = static_cast<double>(pairs_.size());
    const auto& sum = state_.epoch_loss;
    const FieldEpoch epoch{static_cast<int>(state_.step / stepsPerEpoch()),
                           {sum.total / pairs, sum.vertex / pairs, sum.jacobian / pairs},
                           learning_rate_};
    last_loss_ = epoch.loss.total;
    state_.epoch_loss = {};
    if (options_.each_epoch) options_.each_epoch(epoch, current());
  }

  const FieldTrainingState& current() {
    setParameters(matrixOf<Eigen::VectorXf>(parameters_), state_.weights);
    state_.first = matrixOf<Eigen::VectorXf>(first_);
    state_.second = matrixOf<Eigen::VectorXf>(second_);
    return state_;
  }

  Solved<FieldTrainingState> answer(Termination termination) {
    return {current(), {termination, static_cast<int>(state_.step), last_loss_}};
  }

  FieldNetwork network_;
  FieldTrainingOptions options_;
  torch::Tensor parameters_, first_, second_;
  FieldTrainingState state_;
  std::vector<FieldPairTensors> pairs_;
  double learning_rate_ = 0, last_loss_ = 0;
};

void requireState(const FieldTrainingState& state) {
  const auto count = parametersOf(state.weights).size();
  if (state.first.size() != count || state.second.size() != count || state.step < 0)
    throw InvalidInput("state", "has " + std::to_string(state.first.size()) + " and " +
                                    std::to_string(state.second.size()) + " moments, want " + std::to_string(count));
}

}  // namespace

FieldLoss& FieldLoss::operator+=(const FieldLoss& other) {
  total += other.total, vertex += other.vertex, jacobian += other.jacobian;
  return *this;
}

FieldPair makeFieldPair(std::shared_ptr<const FieldReference> reference, const Vertices& source, const Vertices& target,
                        const Scan& scan, const FieldScaling& scaling) {
  auto features = jacobianFieldFeatures(*reference, source, scan, scaling);
  if (target.rows() != source.rows() || !target.allFinite())
    throw InvalidInput("target", "has " + std::to_string(target.rows()) + " vertices, want " +
                                     std::to_string(source.rows()) + ", as the source has, all finite");
  return {std::move(reference), std::move(features), target};
}

FieldTrainingState untrainedState(JacobianFieldWeights weights) {
  const auto count = parametersOf(weights).size();
  return {std::move(weights), Eigen::VectorXf::Zero(count), Eigen::VectorXf::Zero(count), 0, {}};
}

std::optional<std::string> FieldTrainingOptions::firstViolation() const {
  const auto positive = [](double x) { return std::isfinite(x) && x > 0; };
  if (epochs < 1) return "epochs = " + std::to_string(epochs) + ", want >= 1";
  if (batch < 1) return "batch = " + std::to_string(batch) + ", want >= 1";
  if (!positive(learning_rate)) return "learning_rate = " + std::to_string(learning_rate) + ", want > 0";
  if (!positive(last_learning_rate)) return "last_learning_rate = " + std::to_string(last_learning_rate) + ", want > 0";
  if (warm_up < 0) return "warm_up = " + std::to_string(warm_up) + ", want >= 0";
  if (!std::isfinite(vertex_weight) || vertex_weight < 0)
    return "vertex_weight = " + std::to_string(vertex_weight) + ", want >= 0";
  if (!std::isfinite(jacobian_weight) || jacobian_weight < 0)
    return "jacobian_weight = " + std::to_string(jacobian_weight) + ", want >= 0";
  if (vertex_weight == 0 && jacobian_weight == 0) return "jacobian_weight = 0, want > 0 where vertex_weight is 0";
  return std::nullopt;
}

Solved<FieldTrainingState> trainJacobianField(const std::vector<FieldPair>& pairs, FieldTrainingState state,
                                              const FieldTrainingOptions& options) {
  if (const auto violation = options.firstViolation()) throw InvalidInput("options", *violation);
  if (pairs.empty()) throw InvalidInput("pairs", "are none; training takes at least one");
  requireState(state);
  makeTorchDeterministic();
  return FieldTrainer(pairs, std::move(state), options).run();
}

}  // namespace shaped
