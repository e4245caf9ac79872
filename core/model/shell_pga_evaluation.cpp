#include "core/model/shell_pga_evaluation.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <numeric>
#include <random>

#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/shell/energy.h"
#include "core/statistics/linear_pca.h"

namespace shaped {
namespace {

std::vector<int> chosenModes(const ShellPgaModel& model, const EvaluationOptions& options, int largest) {
  std::vector<int> modes = options.modes;
  if (modes.empty())
    for (int step = 1, m = 1; m <= largest; step = std::max(1, m / 2), m += step) modes.push_back(m);
  for (std::size_t i = 0; i < modes.size(); ++i)
    if (modes[i] < 1 || modes[i] > std::min(largest, model.modes()))
      throw InvalidInput("modes[" + std::to_string(i) + "]",
                         std::to_string(modes[i]) + ", want 1 to " + std::to_string(std::min(largest, model.modes())));
  return modes;
}

GeneralisationError errorOf(const GeodesicCalculus& calculus, const Vertices& shape, const Vertices& model_shape) {
  const double energy = shellEnergy(calculus.topology(), shape, model_shape, calculus.bending());
  return {std::sqrt(std::max(energy, 0.0)),
          rmsVertexDistance(apply(alignRigidly(model_shape, shape), model_shape), shape)};
}

/// Retraining without one fold, and the errors on it.
class FoldEvaluator {
 public:
  FoldEvaluator(const ShellPgaModel& model, const std::vector<Vertices>& shapes, const Spider& spider,
                const std::vector<int>& modes, const EvaluationOptions& options)
      : model_(model),
        calculus_(model.submanifold().calculus()),
        shapes_(shapes),
        spider_(spider),
        modes_(modes),
        options_(options) {}

  Outcome run(std::size_t fold, std::size_t folds, ShellPgaEvaluation& sums) const {
    std::vector<Vertices> kept, left_out;
    Spider start{spider_.mean, {}};
    for (std::size_t i = 0; i < shapes_.size(); ++i) {
      if (i % folds == fold) {
        left_out.push_back(shapes_[i]);
        continue;
      }
      kept.push_back(shapes_[i]);
      start.arms.push_back(spider_.arms[i]);
    }
    const auto spider = frechetMean(calculus_, kept, {model_.pga().path_steps, 100, 1e-8, options_.stop, {}, &start});
    Outcome outcome = spider;
    if (options_.stop.stop_requested()) return outcome;
    const int largest = *std::max_element(modes_.begin(), modes_.end());
    auto pga = principalVariations(calculus_, spider.solution, largest, {100, 1e-8, options_.stop});
    outcome += pga;
    if (options_.stop.stop_requested()) return outcome;
    const Submanifold submanifold(model_.submanifold().calculusPtr(),
                                  std::make_shared<ShellPga>(std::move(pga.solution)));
    const auto linear = linearPca(kept);
    for (const auto& shape : left_out)
      if (!options_.stop.stop_requested()) outcome += addErrors(submanifold, linear, shape, sums);
    return outcome;
  }

 private:
  Outcome addErrors(const Submanifold& submanifold, const LinearPca& linear, const Vertices& shape,
                    ShellPgaEvaluation& sums) const {
    std::vector<GeneralisationError> ours(modes_.size()), theirs(modes_.size());
    std::vector<Outcome> outcomes(modes_.size());
    tbb::parallel_for(std::size_t{0}, modes_.size(), [&](std::size_t m) {
      SubmanifoldOptions options;
      options.modes = modes_[m];
      options.stop = options_.stop;
      const auto projected = submanifold.project(shape, options);
      outcomes[m] = projected;
      ours[m] = errorOf(calculus_, shape, projected.solution.shape);
      theirs[m] = errorOf(calculus_, shape, projectLinearly(linear, shape, modes_[m]));
    });
    Outcome outcome;
    const double share = 1.0 / static_cast<double>(shapes_.size());
    for (std::size_t m = 0; m < modes_.size(); ++m) {
      outcome += outcomes[m];
      sums.generalisation[m].elastic += share * ours[m].elastic;
      sums.generalisation[m].vertex += share * ours[m].vertex;
      sums.linear[m].elastic += share * theirs[m].elastic;
      sums.linear[m].vertex += share * theirs[m].vertex;
    }
    return outcome;
  }

  const ShellPgaModel& model_;
  const GeodesicCalculus& calculus_;
  const std::vector<Vertices>& shapes_;
  const Spider& spider_;
  const std::vector<int>& modes_;
  const EvaluationOptions& options_;
};

std::vector<double> compactness(const Eigen::VectorXd& eigenvalues, const std::vector<int>& modes) {
  const Eigen::VectorXd variances = eigenvalues.cwiseMax(0);
  std::vector<double> shares;
  for (const int m : modes) shares.push_back(variances.head(m).sum() / variances.sum());
  return shares;
}

/// The mean over random points of the model's Gaussian of the elastic distance to the nearest shape.
double specificity(const ShellPgaModel& model, const std::vector<Vertices>& shapes, int modes,
                   const EvaluationOptions& options) {
  const auto& calculus = model.submanifold().calculus();
  std::vector<ShellMeasures> known;
  for (const auto& shape : shapes) known.push_back(measure(calculus.topology(), shape));
  std::mt19937 random(options.seed);
  std::normal_distribution<double> normal;
  double sum = 0;
  for (int sample = 0; sample < options.specificity_samples && !options.stop.stop_requested(); ++sample) {
    Eigen::VectorXd y = Eigen::VectorXd::Zero(model.modes());
    for (int j = 0; j < modes; ++j) y[j] = normal(random) * std::sqrt(std::max(model.pga().eigenvalues[j], 0.0));
    SubmanifoldOptions submanifold_options;
    submanifold_options.stop = options.stop;
    const auto shape = model.submanifold().shapeOf(model.submanifold().pointOf(y), submanifold_options).solution.shape;
    const auto measures = measure(calculus.topology(), shape);
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& other : known)
      nearest = std::min(nearest, shellEnergy(calculus.topology(), other, measures, calculus.bending()));
    sum += std::sqrt(nearest);
  }
  return sum / std::max(1, options.specificity_samples);
}

std::size_t foldsOf(const EvaluationOptions& options, std::size_t shapes) {
  return options.folds == 0 ? shapes : static_cast<std::size_t>(options.folds);
}

/// The dimensions to evaluate; throws for options that do not go with the model or so many shapes.
std::vector<int> checkedModes(const ShellPgaModel& model, std::size_t shapes, const EvaluationOptions& options) {
  if (shapes < 3) throw InvalidInput("shapes", "evaluation needs at least three");
  if (options.folds < 0 || options.folds == 1 || options.folds > static_cast<int>(shapes))
    throw InvalidInput("folds",
                       std::to_string(options.folds) + ", want 0 (leave one out) or 2 to " + std::to_string(shapes));
  const auto folds = foldsOf(options, shapes);
  const auto smallest_training = static_cast<int>(shapes - (shapes + folds - 1) / folds);
  if (smallest_training < 2)
    throw InvalidInput("folds", std::to_string(options.folds) + " leaves one of the " + std::to_string(shapes) +
                                    " shapes for training, want at least two");
  return chosenModes(model, options, std::min(model.modes(), smallest_training - 1));
}

/// One evaluation, stage by stage; what a stop interrupts is not counted as done.
class Evaluation {
 public:
  Evaluation(const ShellPgaModel& model, const std::vector<Vertices>& coarse, const EvaluationOptions& options,
             const ProgressSink& progress, const ShellPgaEvaluationResumption& resumption, std::vector<int> modes)
      : model_(model), coarse_(coarse), options_(options), progress_(progress), checkpoint_(resumption.checkpoint) {
    auto& sums = state_.sums;
    sums.modes = std::move(modes);
    sums.generalisation.resize(sums.modes.size());
    sums.linear.resize(sums.modes.size());
    sums.compactness = compactness(model.pga().eigenvalues, sums.modes);
    if (resumption.from) state_ = *resumption.from;
  }

  Solved<ShellPgaEvaluation> run() {
    if (!state_.spider) findMean();
    const auto folds = static_cast<int>(foldsOf(options_, coarse_.size()));
    while (!stopped() && state_.folds < folds) leaveOut(folds);
    while (!stopped() && state_.sums.specificity.size() < state_.sums.modes.size()) sample();
    if (stopped()) state_.outcome.termination = Termination::kCancelled;
    return {std::move(state_.sums), state_.outcome};
  }

 private:
  bool stopped() const { return options_.stop.stop_requested(); }
  void report(const std::string& stage, double fraction) const {
    if (progress_) progress_({stage, fraction, 0});
  }
  void keep() const {
    if (checkpoint_) checkpoint_(state_);
  }

  void findMean() {
    auto spider = frechetMean(model_.submanifold().calculus(), coarse_,
                              {model_.pga().path_steps, 100, 1e-8, options_.stop, {}, nullptr});
    state_.outcome = spider;
    if (stopped()) return;
    state_.spider = std::move(spider.solution);
    keep();
  }

  void leaveOut(int folds) {
    report("fold " + std::to_string(state_.folds + 1) + " of " + std::to_string(folds),
           0.1 + 0.8 * static_cast<double>(state_.folds) / folds);
    auto sums = state_.sums;
    const FoldEvaluator evaluator(model_, coarse_, *state_.spider, sums.modes, options_);
    const auto outcome = evaluator.run(static_cast<std::size_t>(state_.folds), static_cast<std::size_t>(folds), sums);
    if (stopped()) return;
    state_.outcome += outcome;
    state_.sums = std::move(sums);
    ++state_.folds;
    keep();
  }

  void sample() {
    auto& done = state_.sums.specificity;
    const auto& modes = state_.sums.modes;
    report("random shapes, dimension " + std::to_string(modes[done.size()]),
           0.9 + 0.1 * static_cast<double>(done.size()) / static_cast<double>(modes.size()));
    const double value = specificity(model_, coarse_, modes[done.size()], options_);
    if (stopped()) return;
    done.push_back(value);
    keep();
  }

  const ShellPgaModel& model_;
  const std::vector<Vertices>& coarse_;
  const EvaluationOptions& options_;
  const ProgressSink& progress_;
  const std::function<void(const ShellPgaEvaluationState&)>& checkpoint_;
  ShellPgaEvaluationState state_;
};

}  // namespace

std::string ShellPgaEvaluationState::stage() const {
  if (!sums.specificity.empty()) return "folds done, specificity of " + std::to_string(sums.specificity.size());
  return folds == 0 ? "mean of all shapes done" : "fold " + std::to_string(folds) + " done";
}

void requireEvaluable(const ShellPgaModel& model, std::size_t shapes, const EvaluationOptions& options) {
  checkedModes(model, shapes, options);
}

Solved<ShellPgaEvaluation> evaluate(const ShellPgaModel& model, const std::vector<Vertices>& shapes,
                                    const EvaluationOptions& options, const ProgressSink& progress,
                                    const ShellPgaEvaluationResumption& resumption) {
  auto modes = checkedModes(model, shapes.size(), options);
  std::vector<Vertices> coarse;
  for (std::size_t i = 0; i < shapes.size(); ++i)
    coarse.push_back(model.restrict(shapes[i], "shapes[" + std::to_string(i) + "]"));
  return Evaluation(model, coarse, options, progress, resumption, std::move(modes)).run();
}

}  // namespace shaped
