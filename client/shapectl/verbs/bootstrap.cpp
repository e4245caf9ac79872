#include <fstream>
#include <iostream>

#include "client/jobs.h"
#include "client/models.h"
#include "client/scan_upload.h"
#include "client/shapectl/bootstrap_output.h"
#include "client/shapectl/job_output.h"
#include "client/shapectl/job_run.h"
#include "client/shapectl/numbers.h"
#include "client/shapectl/output.h"
#include "client/shapectl/train_method.h"
#include "client/shapectl/training_shapes.h"
#include "client/shapectl/verbs/verbs.h"
#include "core/io/length_unit.h"
#include "core/numerics/error.h"

namespace shaped::shapectl {
namespace {

/// Tells what happens while it does: rounds to the terminal, and to a file each scan as it is registered, and again
/// when its round has ended, one JSON object a line.
class LiveOutput {
 public:
  LiveOutput(bool rounds, const std::string& log) : tells_rounds_(rounds) {
    if (log.empty()) return;
    log_.open(log);
    if (!log_) throw InvalidInput("--log", log + " cannot be written");
  }

  void hear(const v1::WatchJobResponse& news, ProgressBar& bar) {
    for (const auto& scan : news.bootstrap_scans()) write(scan);
    for (const auto& round : news.bootstrap_rounds()) {
      for (const auto& scan : round.scans()) write(scan);
      if (tells_rounds_) tell(round, bar);
    }
  }

  /// Rounds that stand on the terminal.
  std::size_t told() const { return told_; }

 private:
  void write(const v1::BootstrapScan& scan) {
    if (log_.is_open()) log_ << toJson(scan).dump() << std::endl;
  }
  void tell(const v1::BootstrapRound& round, ProgressBar& bar) {
    bar.clear();
    if (told_++ == 0) std::cout << BootstrapOutput::roundHeading();
    std::cout << BootstrapOutput::roundText(round) << std::flush;
  }

  const bool tells_rounds_;
  std::size_t told_ = 0;
  std::ofstream log_;
};

struct Bootstrap {
  std::string name, scans, field_scans, rig, posture, unit = "m", log;
  TrainingShapes training;
  std::int64_t rounds = 5, field_registrations = 0, modes = 0, least_joined = 0, sample = 0, epochs = 0, batch = 0,
               seed = 0;
  double reach = 0, learning_rate = 0;
  std::optional<double> acceptance;
  bool paper_features = false, detach = false;

  void declare(Arguments& arguments) {
    arguments.positional("NAME", name,
                         "The model to grow, which gets a new version; without shapes, it gives its own and its rig");
    training.declare(arguments);
    arguments.option("--scans", scans, "DIR", "The raw scans to register (PLY, OBJ, OFF, STL, .npy, .xyz)");
    arguments.required();
    arguments.option("--rounds", rounds, "N", "At most so many (5)");
    arguments.option("--rig", rig, "RIG.json", "The rig of the template at rest (none: one joint, as for faces)");
    arguments.option("--field-registrations", field_registrations, "N",
                     "The last so many shapes train the field, the others the linear model (half)");
    arguments.option("--field-scans", field_scans, "DIR",
                     "A scan of each of these, by name in their order (a virtual scanner's)");
    arguments.option("--unit", unit, "U", "Of the scans: m, cm, mm, in, ... (m)");
    arguments.option("--modes", modes, "K", "Of the linear model (11)");
    arguments.option("--least-joined", least_joined, "N", "A round in which fewer join is the last (10)");
    arguments.option("--sample", sample, "N", "Scans that a round tries, drawn from those left (all)");
    arguments.option("--acceptance", acceptance, "S",
                     "Standard deviations above the smallest distance up to which scans join (1)");
    arguments.option("--posture", posture, "HOW",
                     "How the posture is taken out: none, skeleton or local (the model's; else skeleton)");
    arguments.option("--reach", reach, "M", "Of the neighbourhoods of --posture local [m] (0.1)");
    arguments.option("--epochs", epochs, "N", "Of the field's training (100)");
    arguments.option("--batch", batch, "N", "Shapes a step of it (4)");
    arguments.option("--learning-rate", learning_rate, "R", "Of it, at first (0.001)");
    arguments.flag("--paper-features", paper_features, "Give the field the features of the paper alone");
    arguments.option("--seed", seed, "S", "Of virtual scans, samples and the field (1)");
    arguments.option("--log", log, "LOG.jsonl", "Write each scan down as it is registered, and when its round ends");
    arguments.flag("--detach", detach, "Leave the job to itself: `shapectl watch JOB`, `shapectl result JOB`");
  }

  ExitCode run(const Session& session) const {
    if (detach && !log.empty()) throw InvalidInput("--log", "goes without --detach: nobody would write it");
    auto request = requestOf();
    LiveOutput live(!session.json, log);
    const auto channel = session.channel();
    const auto jobs = v1::Jobs::NewStub(channel);
    v1::Job job;
    {
      ProgressBar bar;
      addShapes(channel, session, bar, request);
      addScans(channel, session, bar, *request.mutable_bootstrap());
      job = client::startTraining(*jobs, request, session.callOptions());
      if (!detach) job = follow(*jobs, job, session, bar, [&](const auto& news) { live.hear(news, bar); });
    }
    if (detach) return printStarted(job, session);
    if (job.state() != v1::JOB_STATE_SUCCEEDED) return printEnded(job, session);
    return printGrown(*jobs, job, live.told(), session);
  }

 private:
  v1::TrainRequest requestOf() const {
    v1::TrainRequest request;
    request.set_model_name(name);
    auto& bootstrap = *request.mutable_bootstrap();
    bootstrap.set_posture(postureNamed(posture));
    bootstrap.set_reach(reach);
    bootstrap.set_rounds(countOf("--rounds", rounds));
    bootstrap.set_field_registrations(countOf("--field-registrations", field_registrations));
    bootstrap.set_modes(countOf("--modes", modes));
    bootstrap.set_least_joined(countOf("--least-joined", least_joined));
    bootstrap.set_sample(countOf("--sample", sample));
    if (acceptance) bootstrap.set_acceptance(*acceptance);
    bootstrap.set_seed(countOf("--seed", seed));
    auto& field = *bootstrap.mutable_field();
    field.set_epochs(countOf("--epochs", epochs));
    field.set_batch(countOf("--batch", batch));
    field.set_learning_rate(learning_rate);
    field.set_paper_features(paper_features);
    return request;
  }

  /// The registrations and the rig: files, or what the model was trained on.
  void addShapes(const std::shared_ptr<grpc::Channel>& channel, const Session& session, ProgressBar& bar,
                 v1::TrainRequest& request) const {
    if (!training.given()) {
      if (!rig.empty()) throw InvalidInput("--rig", "goes with --template and --frames, or with MESH files");
      *request.mutable_bootstrap()->mutable_template_model() = templateModel(channel, session);
      return;
    }
    const auto shapes = training.source();
    if (!rig.empty()) request.mutable_bootstrap()->set_rig(rigText(rig, shapes.vertexCount()));
    request.set_dataset(uploadShapes(channel, shapes, name, session, bar));
  }

  v1::ModelSelector templateModel(const std::shared_ptr<grpc::Channel>& channel, const Session& session) const {
    const auto missing = [&](const std::string& why) {
      return InvalidInput("NAME", why +
                                      ": name its registrations with --template and --frames, or as MESH files, and "
                                      "its rig with --rig");
    };
    try {
      const auto model = client::getModelMesh(channel, parseModel(name), session.callOptions()).description;
      if (!model.has_body()) throw missing("\"" + name + "\" is of kind " + model.kind() + ", which cannot be grown");
      if (model.dataset().empty()) throw missing("\"" + name + "\" does not say what it was trained on");
      return client::pinned(model);
    } catch (const client::RpcError& error) {
      if (error.code() != grpc::NOT_FOUND) throw;
      throw missing("there is no model \"" + name + "\" to grow yet");
    }
  }

  void addScans(const std::shared_ptr<grpc::Channel>& channel, const Session& session, ProgressBar& bar,
                v1::Bootstrap& bootstrap) const {
    const auto metres = metresPer(unit);
    if (!metres) throw InvalidInput("--unit", "\"" + unit + "\" is no unit of length; want m, cm, mm, in, ...");
    const auto upload = [&](const char* option, const std::string& folder) {
      const client::ScanFolder files(option, folder, *metres);
      const auto count = static_cast<double>(files.count());
      const auto show = [&](std::int64_t sent) { bar.show(static_cast<double>(sent) / count, "uploading scans"); };
      return client::uploadScans(channel, client::contentName(files, name), files, session.callOptions(), show).name();
    };
    bootstrap.set_scans(upload("--scans", scans));
    if (!field_scans.empty()) bootstrap.set_field_scans(upload("--field-scans", field_scans));
  }

  static ExitCode printGrown(v1::Jobs::Stub& jobs, const v1::Job& job, std::size_t told, const Session& session) {
    BootstrapOutput output;
    client::fetchResult(jobs, job.id(), session.callOptions(),
                        [&](const auto& answer) { output.add(answer.bootstrap_round()); });
    auto document = toJson(job);
    document.update(output.document());
    if (session.json)
      printJson(document);
    else
      std::cout << output.text(told) << jobText(job) << "\n";
    return ExitCode::kSuccess;
  }
};

}  // namespace

Verb bootstrapVerb() {
  return makeVerb<Bootstrap>("bootstrap", "Grow a body model by raw scans: upload them, start the job, follow it");
}

}  // namespace shaped::shapectl
