#include "core/bootstrap/bootstrap.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <set>

#include "core/bootstrap/acceptance.h"
#include "core/bootstrap/field_examples.h"
#include "core/bootstrap/field_judgement.h"
#include "core/bootstrap/round_scans.h"
#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/registration/fit_evidence.h"
#include "core/registration/scan_checks.h"
#include "core/surface/laplacian.h"

namespace shaped {
namespace {

/// Parts of a round's share of the whole, about as they take their time.
constexpr double kFieldBegins = 0.3, kScansBegin = 0.5;

void requireInputs(const BootstrapInputs& inputs, const FieldTrainer& train, const BootstrapOptions& options) {
  if (const auto problem = options.firstViolation()) throw InvalidInput("options", *problem);
  if (!train) throw InvalidInput("train", "is empty, want a function that trains a field");
  if (inputs.registrations.size() < 2)
    throw InvalidInput("registrations", "has " + std::to_string(inputs.registrations.size()) + ", want at least two");
  if (inputs.scans.count == 0) throw InvalidInput("scans", "there is none; want at least one that is not registered");
  if (!inputs.scans.load || !inputs.scans.name) throw InvalidInput("scans", "have no function that loads or names one");
}

void requireSameKind(const BootstrapCheckpoint& checkpoint, const BootstrapInputs& inputs,
                     const FieldExamples& field_examples) {
  const auto examples = checkpoint.examples.size();
  bool fits = examples == 0 || examples == field_examples.count();
  for (const auto& scan : checkpoint.scans) fits = fits && scan.report.scan < inputs.scans.count;
  for (const auto& shape : checkpoint.joined) fits = fits && shape.rows() == inputs.reference.rest.rows();
  if (!fits) throw InvalidInput("checkpoint", "is of other inputs; begin anew");
}

/// What the fit of a scan of R_DEFORM leaves.
struct TaughtResidual {
  std::size_t scan;  ///< of FieldExamples
  ResidualExample residual;
};

/// A run of Algorithm 2 from a checkpoint on.
class Bootstrap {
 public:
  Bootstrap(const BootstrapInputs& inputs, const FieldTrainer& train, const BootstrapOptions& options,
            const BootstrapWatch& watch, BootstrapCheckpoint state)
      : inputs_(inputs), train_(train), options_(options), watch_(watch), state_(std::move(state)) {
    teach();
    requireSameKind(state_, inputs, *examples_);
    state_.examples.resize(examples_->count());
  }

  std::optional<Bootstrapped> run() {
    auto grown = grownModel();
    if (!grown) note([] {});  // stopped: whoever keeps checkpoints is offered the last
    return grown;
  }

 private:
  std::optional<Bootstrapped> grownModel() {
    while (true) {
      auto trained = learnModel();
      if (!trained) return std::nullopt;
      reference_.reset();
      if (!state_.field && !learnField(trained->model)) return std::nullopt;
      if (const auto end = endReached())
        return Bootstrapped{std::move(trained->model),
                            std::move(trained->variances),
                            *state_.field,
                            state_.rounds,
                            state_.joined,
                            *end};
      if (!runRound(trained->model)) return std::nullopt;
    }
  }

  std::optional<TrainedBody> learnModel() {
    tell("learning a model of " + std::to_string(registrations_.size()) + " registrations", 0);
    BodyTrainingOptions training;
    training.posture = options_.posture;
    training.reach = options_.reach;
    training.modes = options_.modes;
    training.stop = watch_.stop;
    return trainBody(inputs_.reference, registrations_, training);
  }

  /// Null once the token has fired.
  std::shared_ptr<const FieldReference> referenceOf(const BodyModel& model) {
    if (reference_) return reference_;
    auto made = makeFieldReference(model.topology(), model.parts().mean, watch_.stop);
    if (made) reference_ = std::make_shared<const FieldReference>(std::move(*made));
    return reference_;
  }

  bool learnField(const BodyModel& model) {
    if (!fitExamples(model)) return false;
    const auto residuals = residualsOf(model);
    if (stopped()) return false;
    auto regression = regressionOf(model, residuals);
    FieldTrainingSet set{state_.trainings + 1, referenceOf(model), {}, pairsOf(model, residuals, regression.held_out)};
    if (!set.reference || stopped()) return false;
    if (set.pairs.empty())
      throw InvalidInput("examples",
                         "none can be fitted by the model, so that there is nothing to train a field on; "
                         "do the scans show what the registrations do?");
    const auto smoothness = smoothnessOf(*set.reference, set.pairs);
    if (smoothness.prior) smooth(*set.reference, *smoothness.prior, set.pairs);
    const auto judges = takeJudges(set.pairs);
    set.scaling = scalingOf(*set.reference);
    tell("training the field on " + std::to_string(set.pairs.size()) + " scans", kFieldBegins);
    auto field = train_(set, watch_.stop);
    if (!field) return false;
    const JacobianField complete(*field);  // says what does not fit
    if (!judges.empty()) field = judged(set, std::move(*field), judges);
    field->regression = std::move(regression.weights);
    field->smoothness = smoothness.prior;
    note([&] {
      state_.field = std::move(field);
      ++state_.trainings;
    });
    return true;
  }

  /// The field, silenced where it does not help bodies that it has not seen.
  JacobianFieldWeights judged(const FieldTrainingSet& set, JacobianFieldWeights field,
                              const std::vector<RestPair>& judges) const {
    const auto judgement = judgeField(set, field, judges);
    const auto millimetres = [](double metres) { return std::to_string(std::round(1e5 * metres) / 100).substr(0, 5); };
    tell(std::string(judgement.helps() ? "the field helps" : "the field does not help and is silenced") + ": of " +
             std::to_string(judges.size()) + " scans held out it leaves " + millimetres(judgement.after) +
             " mm where there were " + millimetres(judgement.before) + " mm",
         kScansBegin);
    return judgement.helps() ? std::move(field) : silenced(std::move(field));
  }

  bool fitExamples(const BodyModel& model) {
    forAll(examples_->count(), [&](std::size_t i) {
      if (state_.examples[i]) return;
      auto fitted = examples_->fit(i, model, watch_.stop);
      if (!fitted) return;
      note([&] {
        state_.examples[i] = std::move(fitted);
        const auto done = std::count_if(state_.examples.begin(), state_.examples.end(),
                                        [](const auto& example) { return example.has_value(); });
        tellOf("fitting the field's scans, ", done, examples_->count(), 0, kFieldBegins);
      });
    });
    return !stopped();
  }

  /// Of the scans that were fitted and show enough, in their order.
  std::vector<TaughtResidual> residualsOf(const BodyModel& model) const {
    std::vector<std::optional<ResidualExample>> found(examples_->count());
    forAll(found.size(), [&](std::size_t i) {
      if (taught(i)) found[i] = examples_->residual(i, model, *state_.examples[i]);
    });
    std::vector<TaughtResidual> residuals;
    for (std::size_t i = 0; i < found.size(); ++i)
      if (found[i]) residuals.push_back({i, std::move(*found[i])});
    return residuals;
  }

  FittedResiduals regressionOf(const BodyModel& model, const std::vector<TaughtResidual>& residuals) const {
    std::vector<ResidualExample> examples;
    for (const auto& taught : residuals) examples.push_back(taught.residual);
    return fitResiduals(examples, lumpedAreas(model.parts().mean, model.topology()->faces()));
  }

  std::vector<RestPair> pairsOf(const BodyModel& model, const std::vector<TaughtResidual>& residuals,
                                const std::vector<Vertices>& predicted) const {
    std::vector<std::optional<RestPair>> pairs(residuals.size());
    forAll(pairs.size(), [&](std::size_t k) {
      const auto& [i, residual] = residuals[k];
      pairs[k] = examples_->pair(i, model, *state_.examples[i], residual, predicted[k]);
    });
    std::vector<RestPair> usable;
    for (auto& pair : pairs)
      if (pair) usable.push_back(std::move(*pair));
    return usable;
  }

  /// How what the regression leaves may be smoothed over the surface.
  FittedSmoothness smoothnessOf(const FieldReference& reference, const std::vector<RestPair>& pairs) const {
    std::vector<SmoothExample> examples(pairs.size());
    forAll(pairs.size(), [&](std::size_t k) {
      const auto& pair = pairs[k];
      const Vertices normals = vertexNormals(reference.poisson->topology().faces(), pair.source);
      examples[k] = {normals, scanOffsets(pair.source, normals, pair.scan), pair.target - pair.source};
    });
    if (stopped()) return {};
    return fitSmoothness(reference.spectrum, boundingBoxDiagonal(reference.shape), examples);
  }

  /// Brings the pairs' sources as near as a fit's surface is when the field sees it.
  void smooth(const FieldReference& reference, const SmoothPrior& prior, std::vector<RestPair>& pairs) const {
    forAll(pairs.size(), [&](std::size_t k) {
      pairs[k].source += smoothDisplacements(reference, prior, pairs[k].source, pairs[k].scan);
    });
  }

  bool taught(std::size_t i) const { return state_.examples[i] && state_.examples[i]->identity.size() > 0; }

  std::optional<BootstrapEnd> endReached() const {
    const auto& rounds = state_.rounds;
    if (!rounds.empty() && rounds.back().joined < static_cast<std::size_t>(options_.least_joined))
      return BootstrapEnd::kFewJoined;
    if (std::ssize(rounds) >= options_.rounds) return BootstrapEnd::kRoundsDone;
    if (scansToTry(inputs_.scans.count, rounds, options_).empty()) return BootstrapEnd::kNoneLeft;
    return std::nullopt;
  }

  bool runRound(const BodyModel& model) {
    auto registration = options_.registration;
    registration.refine = false;
    registration.stop = watch_.stop;
    const auto reference = referenceOf(model);
    if (!reference) return false;
    registration.field = std::make_shared<const FieldDeformation>(reference, *state_.field);
    const RoundScans scans{inputs_.scans, model, registration};
    return registerScans(scans) && endRound(scans);
  }

  bool registerScans(const RoundScans& scans) {
    const auto chosen = scansToTry(inputs_.scans.count, state_.rounds, options_);
    std::vector<std::size_t> waiting;
    for (const auto scan : chosen)
      if (placeOf(scan) == state_.scans.end()) waiting.push_back(scan);
    forAll(waiting.size(), [&](std::size_t i) {
      auto fitted = scans.fit(waiting[i], roundNumber());
      if (!fitted) return;
      note([&] {
        if (watch_.each_scan) watch_.each_scan(fitted->report);
        const auto at = std::partition_point(state_.scans.begin(), state_.scans.end(), [&](const FittedScan& done) {
          return done.report.scan < fitted->report.scan;
        });
        state_.scans.insert(at, std::move(*fitted));
        tellOf("registering scans, ", std::ssize(state_.scans), chosen.size(), kScansBegin, 1);
      });
    });
    return !stopped();
  }

  std::vector<FittedScan>::const_iterator placeOf(std::size_t scan) const {
    return std::find_if(state_.scans.begin(), state_.scans.end(),
                        [&](const FittedScan& done) { return done.report.scan == scan; });
  }

  /// Those that join are deformed once more: their surfaces are too large to be kept for all that are tried.
  bool endRound(const RoundScans& scans) {
    BootstrapRound round;
    round.round = roundNumber();
    round.registrations = registrations_.size();
    std::set<std::size_t> examples;
    for (std::size_t i = 0; i < examples_->count(); ++i)
      if (taught(i)) examples.insert(examples_->example(i));
    round.examples = examples.size();
    for (const auto& fitted : state_.scans) round.scans.push_back(fitted.report);
    judge(options_.acceptance, round);
    std::vector<const FittedScan*> joining;
    for (std::size_t i = 0; i < round.scans.size(); ++i)
      if (round.scans[i].verdict == ScanVerdict::kJoined) joining.push_back(&state_.scans[i]);
    std::vector<Vertices> surfaces(joining.size());
    forAll(joining.size(), [&](std::size_t i) { surfaces[i] = scans.restSurface(*joining[i]); });
    if (stopped()) return false;
    note([&] { grow(std::move(round), surfaces); });
    return true;
  }

  void grow(BootstrapRound round, const std::vector<Vertices>& surfaces) {
    state_.joined.insert(state_.joined.end(), surfaces.begin(), surfaces.end());
    state_.scans.clear();
    state_.rounds.push_back(std::move(round));
    const auto before = registrations_.size();
    teach();
    if (registrations_.size() > before) {  // else model and field are what they would become
      state_.field.reset();
      state_.examples.assign(examples_->count(), std::nullopt);
    }
    if (watch_.each_round) watch_.each_round(state_.rounds.back());
  }

  /// What the coming round learns from.
  void teach() {
    examples_.emplace(inputs_, options_, state_.rounds.size(), state_.joined);
    registrations_ = modelRegistrations(inputs_, options_, state_.rounds.size(), state_.joined);
  }

  int roundNumber() const { return static_cast<int>(state_.rounds.size()) + 1; }

  template <class Work>
  void forAll(std::size_t count, const Work& work) const {
    // One at a time to each thread: they take seconds, and differ.
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, count, 1),
        [&](const auto& range) {
          for (auto i = range.begin(); i < range.end(); ++i)
            if (!stopped()) work(i);
        },
        tbb::simple_partitioner());
  }

  /// Changes the state, and offers it.
  template <class Change>
  void note(const Change& change) {
    const std::lock_guard lock(mutex_);
    change();
    if (watch_.checkpoint) watch_.checkpoint([this] { return state_; });
  }

  bool stopped() const { return watch_.stop.stop_requested(); }

  void tell(const std::string& what, double share) const {
    if (!watch_.progress) return;
    const auto number = roundNumber();
    const bool last = endReached().has_value();
    const std::string where =
        last ? "last model: " : "round " + std::to_string(number) + " of " + std::to_string(options_.rounds) + ": ";
    // Of all rounds and what is learned after them.
    const double done = last ? options_.rounds + share : number - 1 + share;
    watch_.progress({where + what, done / (options_.rounds + 1), 0});
  }

  void tellOf(const std::string& what, std::ptrdiff_t done, std::size_t count, double from, double to) const {
    tell(what + std::to_string(done) + " of " + std::to_string(count),
         from + (to - from) * static_cast<double>(done) / static_cast<double>(count));
  }

  const BootstrapInputs& inputs_;
  const FieldTrainer& train_;
  const BootstrapOptions& options_;
  const BootstrapWatch& watch_;
  BootstrapCheckpoint state_;
  std::optional<FieldExamples> examples_;            ///< of the round; refers to what joined
  std::vector<Vertices> registrations_;              ///< R_PCA
  std::shared_ptr<const FieldReference> reference_;  ///< of the present model, once it is wanted
  std::mutex mutex_;                                 ///< of the state while scans are worked on, and of who watches
};

}  // namespace

std::vector<Vertices> modelRegistrations(const BootstrapInputs& inputs, const BootstrapOptions& options,
                                         std::size_t rounds, const std::vector<Vertices>& joined) {
  auto registrations = inputs.registrations;
  if (options.share_registrations && rounds > 0)
    for (const auto& example : inputs.examples) registrations.push_back(example.registration);
  registrations.insert(registrations.end(), joined.begin(), joined.end());
  return registrations;
}

std::optional<Bootstrapped> bootstrapBody(const BootstrapInputs& inputs, const FieldTrainer& train,
                                          const BootstrapOptions& options, const BootstrapWatch& watch,
                                          std::optional<BootstrapCheckpoint> resumed) {
  requireInputs(inputs, train, options);
  return Bootstrap(inputs, train, options, watch, resumed ? std::move(*resumed) : BootstrapCheckpoint{}).run();
}

}  // namespace shaped
