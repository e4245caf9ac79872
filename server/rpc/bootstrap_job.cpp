#include "server/rpc/bootstrap_job.h"

#include <tbb/task_arena.h>

#include "core/bootstrap/bootstrap.h"
#include "core/io/rig_file.h"
#include "core/mesh/quality.h"
#include "core/model/body_shapes.h"
#include "core/numerics/error.h"
#include "server/convert/bootstrap.h"
#include "server/convert/model.h"
#include "server/errors/errors.h"
#include "server/field_training/trainer_process.h"
#include "server/jobs/record_file.h"
#include "server/models/kind.h"
#include "server/rpc/job_checkpoint.h"
#include "server/telemetry/call_log.h"

namespace shaped::server {
namespace {

using Clock = std::chrono::steady_clock;

// What the job keeps of its datasets, in its folder.
constexpr const char *kRegistrations = "registrations", *kScans = "scans", *kFieldScans = "field_scans";
constexpr int kAnyCount = 1'000'000;
constexpr std::int64_t kFewestRegistrations = 3;

BootstrapOptions optionsFrom(const v1::Bootstrap& message) {
  const auto count = [](std::uint32_t value, int otherwise, const char* field) {
    return value == 0 ? otherwise : countFromProto(value, kAnyCount, field);
  };
  BootstrapOptions options;
  options.posture = postureFromProto(message.posture(), "bootstrap.posture");
  if (message.reach() != 0) options.reach = message.reach();
  if (message.has_rounds()) options.rounds = countFromProto(message.rounds(), kAnyCount, "bootstrap.rounds");
  options.modes = count(message.modes(), options.modes, "bootstrap.modes");
  options.least_joined = count(message.least_joined(), options.least_joined, "bootstrap.least_joined");
  options.sample = countFromProto(message.sample(), kAnyCount, "bootstrap.sample");
  if (message.has_acceptance()) options.acceptance = message.acceptance();
  if (message.seed() != 0) options.seed = message.seed();
  if (const auto violation = options.firstViolation()) throw InvalidInput("bootstrap", *violation);
  return options;
}

FieldJobOptions fieldOptionsFrom(const v1::Bootstrap& message) {
  const auto& field = message.field();
  FieldJobOptions options;
  if (field.epochs() != 0) options.epochs = countFromProto(field.epochs(), kAnyCount, "bootstrap.field.epochs");
  if (field.batch() != 0) options.batch = countFromProto(field.batch(), kAnyCount, "bootstrap.field.batch");
  if (field.learning_rate() != 0) options.learning_rate = field.learning_rate();
  options.offsets = !field.paper_features();
  if (message.seed() != 0) options.seed = message.seed();
  if (const auto violation = options.firstViolation()) throw InvalidInput("bootstrap.field", *violation);
  return options;
}

/// Of n registrations, those that train the field.
std::int64_t fieldRegistrations(const v1::Bootstrap& message, const std::string& dataset, std::int64_t n) {
  if (n < kFewestRegistrations)
    throw InvalidInput("dataset", "\"" + dataset + "\" holds " + std::to_string(n) +
                                      " registrations; a bootstrap needs at least three, two for the model and one for "
                                      "its field");
  const std::int64_t wanted = message.field_registrations() == 0 ? n / 2 : message.field_registrations();
  if (wanted > n - 2)
    throw InvalidInput("bootstrap.field_registrations", "= " + std::to_string(wanted) + ", want at most " +
                                                            std::to_string(n - 2) + " of the dataset's " +
                                                            std::to_string(n) + ": two are for the model");
  return wanted;
}

std::optional<Rig> rigFrom(const v1::Bootstrap& message, std::int32_t vertex_count) {
  if (message.rig().empty()) return std::nullopt;
  return parseRig("bootstrap.rig", message.rig(), vertex_count).rig;
}

void requireScans(const DatasetStore& datasets, const v1::Bootstrap& message, std::int64_t field_registrations) {
  if (message.scans().empty())
    throw InvalidInput("bootstrap.scans", "is missing: name a dataset of raw scans that are to be registered");
  datasets.getScans(message.scans(), "bootstrap.scans");
  if (message.field_scans().empty()) return;
  const auto scans = datasets.getScans(message.field_scans(), "bootstrap.field_scans").frames;
  if (scans != field_registrations)
    throw InvalidInput("bootstrap.field_scans", "\"" + message.field_scans() + "\" holds " + std::to_string(scans) +
                                                    " scans, want one for each of the " +
                                                    std::to_string(field_registrations) +
                                                    " registrations that train the field");
}

/// The dataset that a model was trained on. Throws InvalidInput, NotFound.
std::string datasetOf(const ServedModel& served, const DatasetStore& datasets) {
  auto name = provenanceOf(served.manifest).dataset;
  if (name.empty()) throw InvalidInput("dataset", "is missing, and the model does not say what it was trained on");
  try {
    datasets.get(name);
  } catch (const NotFound&) {
    throw NotFound("the dataset \"" + name + "\" that model " + served.name + " version " +
                   std::to_string(served.version) + " was trained on has been deleted; name another");
  }
  return name;
}

/// The model that gives the template; dataset, posture and reach are its own where none are named.
void takeTemplateModel(const JobContext& context, v1::TrainRequest& request) {
  auto& bootstrap = *request.mutable_bootstrap();
  if (!bootstrap.rig().empty())
    throw InvalidInput("bootstrap.rig", "goes without template_model, which has a rig of its own");
  const auto served = context.models.pin(selectorFromProto(bootstrap.template_model()));
  const auto& training = bodyFor("a bootstrap's template", *served).training();
  nameVersion(*served, *bootstrap.mutable_template_model());
  if (request.dataset().empty()) request.set_dataset(datasetOf(*served, context.datasets));
  if (bootstrap.posture() == v1::POSTURE_NORMALISATION_UNSPECIFIED) bootstrap.set_posture(toProto(training.posture));
  if (bootstrap.reach() == 0) bootstrap.set_reach(training.reach);
  requireConnectivity(*served, context.datasets.get(request.dataset()));
}

/// A job of this kind while it runs.
class BootstrapRun {
 public:
  BootstrapRun(const JobContext& context, const JobRun& run)
      : context_(context),
        run_(run),
        request_(requestOf<v1::TrainRequest>(run.job)),
        options_(optionsFrom(request_.bootstrap())),
        checkpoint_(run, context.checkpoint_every) {}

  JobResult work() {
    requireTrainer(context_.trainer);
    keepDatasets();
    const auto inputs = makeInputs();
    options_.scanner = scannerFor(boundingBoxDiagonal(inputs.reference.rest));
    auto found = checkpoint_.find(training(), readBootstrapCheckpoint);
    run_.resumed(found ? found->stage() : "");
    if (found) tellAgain(*found);
    auto grown = bootstrapBody(inputs, fieldTrainer(trainerProcess()), options_, watch(), std::move(found));
    JobResult result{request_.model_name(), 0, {}, std::chrono::duration<double>(Clock::now() - begin_).count(), 0, {}};
    result.outcome.termination = grown ? Termination::kConverged : Termination::kCancelled;
    if (grown) result.outcome.iterations = static_cast<int>(grown->rounds.size());
    context_.metrics.method("Jobs.Train").solved(result.outcome);
    if (grown) publish(std::move(*grown), inputs, result);
    return result;
  }

 private:
  /// Its inputs lie in its folder, so that the job itself says what a checkpoint is of.
  std::string training() const { return "bootstrap " + run_.job.key; }

  void keepDatasets() {
    const auto keep = [&](const std::string& dataset, const char* folder) {
      patiently(context_, run_, [&] { context_.datasets.keep(dataset, run_.folder / folder); });
    };
    keep(request_.dataset(), kRegistrations);
    keep(request_.bootstrap().scans(), kScans);
    if (!request_.bootstrap().field_scans().empty()) keep(request_.bootstrap().field_scans(), kFieldScans);
  }

  BootstrapInputs makeInputs() const {
    auto dataset = readDataset(run_.folder / kRegistrations);
    const auto n = std::ssize(dataset.shapes);
    const auto taught = fieldRegistrations(request_.bootstrap(), request_.dataset(), n);
    BootstrapInputs inputs{templateOf(dataset), {}, makeExamples(dataset, taught), scanSource()};
    dataset.shapes.resize(static_cast<std::size_t>(n - taught));
    inputs.registrations = std::move(dataset.shapes);
    return inputs;
  }

  PostureTemplate templateOf(const Dataset& dataset) const {
    const auto& bootstrap = request_.bootstrap();
    if (bootstrap.has_template_model()) {
      const auto served = pinForJob(context_, run_, bootstrap.template_model());
      return bodyFor("a bootstrap's template", *served).reference();
    }
    const auto& rest = dataset.template_shape ? *dataset.template_shape : dataset.shapes.front();
    auto rig = rigFrom(bootstrap, dataset.topology->vertexCount());
    return makePostureTemplate(dataset.topology, rest, rig ? std::move(*rig) : rigidRig(rest));
  }

  /// The last registrations of the dataset.
  std::vector<FieldExample> makeExamples(const Dataset& dataset, std::int64_t count) const {
    std::optional<DatasetScans> scans;
    if (!request_.bootstrap().field_scans().empty()) scans.emplace(run_.folder / kFieldScans);
    std::vector<FieldExample> examples;
    for (std::int64_t i = 0; i < count; ++i) {
      const auto shape = dataset.shapes.end() - count + i;
      examples.push_back({*shape, scans ? std::optional(scans->scan(i)) : std::nullopt});
    }
    return examples;
  }

  ScanSource scanSource() const {
    const auto scans = std::make_shared<const DatasetScans>(run_.folder / kScans);
    return {static_cast<std::size_t>(scans->count()),
            [scans](std::size_t i) { return scans->scan(static_cast<std::int64_t>(i)); },
            [scans](std::size_t i) { return scans->name(static_cast<std::int64_t>(i)); }};
  }

  TrainerProcess trainerProcess() {
    return {context_.trainer,
            run_.folder,
            fieldOptionsFrom(request_.bootstrap()),
            {tbb::this_task_arena::max_concurrency(), context_.checkpoint_every.count()},
            [this](const FieldProgress& field) {
              auto progress = progress_;  // nothing else goes on meanwhile
              progress.stage += ", epoch " + std::to_string(field.epoch) + " of " + std::to_string(field.epochs);
              run_.progress(progress);
            },
            [this](const std::string& text) { logError("job " + run_.job.id + ": " + text); }};
  }

  BootstrapWatch watch() {
    BootstrapWatch watch;
    watch.stop = run_.stop;
    watch.progress = [this](const Progress& progress) { run_.progress(progress_ = progress); };
    watch.each_scan = [this](const BootstrapScan& scan) { tell(scan); };
    watch.each_round = [this](const BootstrapRound& round) { tell(round); };
    watch.checkpoint = [this](const std::function<BootstrapCheckpoint()>& state) {
      checkpoint_.offer([&](const std::filesystem::path& path) {
        auto checkpoint = state();
        checkpoint.training = training();
        writeBootstrapCheckpoint(path, checkpoint);
      });
    };
    return watch;
  }

  void tell(const BootstrapScan& scan) const {
    v1::WatchJobResponse news;
    toProto(scan, *news.add_bootstrap_scans());
    run_.tell(news.SerializeAsString());
  }

  void tell(const BootstrapRound& round) const {
    v1::WatchJobResponse news;
    toProto(round, *news.add_bootstrap_rounds());
    run_.tell(news.SerializeAsString());
  }

  void tellAgain(const BootstrapCheckpoint& checkpoint) const {
    for (const auto& round : checkpoint.rounds) tell(round);
    for (const auto& scan : checkpoint.scans) tell(scan.report);
  }

  void writeResult(const Bootstrapped& grown) const {
    RecordWriter writer(run_.folder / kResultFile, 0);
    for (const auto& round : grown.rounds) {
      v1::GetJobResultResponse answer;
      toProto(round, *answer.mutable_bootstrap_round());
      if (&round == &grown.rounds.back()) answer.mutable_bootstrap_round()->set_end(toProto(grown.end));
      writer.append(answer.SerializeAsString());
    }
    writer.sync();
  }

  void publish(Bootstrapped grown, const BootstrapInputs& inputs, JobResult& result) const {
    patiently(context_, run_, [&] { writeResult(grown); });
    BodyTrainingRecord record{static_cast<int>(inputs.registrations.size() + grown.joined.size()),
                              options_.posture,
                              options_.reach,
                              std::move(grown.variances),
                              result.seconds,
                              {}};
    for (const auto& round : grown.rounds) record.joined.push_back(static_cast<int>(round.joined));
    const auto model =
        std::make_shared<const BodyShapes>(std::move(grown.model), std::move(record), std::move(grown.field));
    result.smallest_area_ratio =
        smallestAreaRatio(model->topology().faces(), inputs.registrations.front(), model->mean());
    patiently(context_, run_, [&] { run_.solved(result); });
    const Provenance provenance{request_.dataset(), std::chrono::system_clock::now(), run_.job.id, run_.job.key};
    patiently(context_, run_, [&] {
      result.model_version = context_.models.publish(request_.model_name(), model, provenance)->version;
    });
  }

  const JobContext& context_;
  const JobRun& run_;
  const v1::TrainRequest request_;
  BootstrapOptions options_;
  JobCheckpoint checkpoint_;
  Progress progress_;  ///< the last that the bootstrap told
  const Clock::time_point begin_ = Clock::now();
};

}  // namespace

JobKind bootstrapTraining(const JobContext& context) {
  return {[&context](const JobRun& run) { return BootstrapRun(context, run).work(); },
          [&context](const JobRecord& job) { return context.models.publishedBy(job.model_name, job.key); }};
}

void prepareBootstrap(const JobContext& context, v1::TrainRequest& request) {
  const auto& bootstrap = request.bootstrap();
  optionsFrom(bootstrap);
  fieldOptionsFrom(bootstrap);
  if (bootstrap.has_template_model()) takeTemplateModel(context, request);
  const auto dataset = context.datasets.get(request.dataset());
  rigFrom(bootstrap, dataset.vertex_count);
  requireScans(context.datasets, bootstrap, fieldRegistrations(bootstrap, dataset.name, dataset.frames));
  requireTrainer(context.trainer);
}

void repeatBootstrap(const JobRecord& known, v1::TrainRequest& request) {
  if (known.kind != kBootstrap) return;
  const auto before = requestOf<v1::TrainRequest>(known);
  auto& bootstrap = *request.mutable_bootstrap();
  if (bootstrap.has_template_model() && before.bootstrap().has_template_model())
    repeatVersion(before.bootstrap().template_model(), *bootstrap.mutable_template_model());
  if (bootstrap.has_template_model() && bootstrap.posture() == v1::POSTURE_NORMALISATION_UNSPECIFIED)
    bootstrap.set_posture(before.bootstrap().posture());
  if (bootstrap.has_template_model() && bootstrap.reach() == 0) bootstrap.set_reach(before.bootstrap().reach());
  if (request.dataset().empty()) request.set_dataset(before.dataset());
}

}  // namespace shaped::server
