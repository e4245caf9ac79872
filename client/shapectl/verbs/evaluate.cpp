#include <filesystem>

#include "client/dataset_upload.h"
#include "client/shapectl/evaluation_output.h"
#include "client/shapectl/job_run.h"
#include "client/shapectl/numbers.h"
#include "client/shapectl/output.h"
#include "client/shapectl/progress_bar.h"
#include "client/shapectl/verbs/verbs.h"
#include "core/io/file.h"
#include "shaped/v1/shapes.grpc.pb.h"

namespace shaped::shapectl {
namespace {

struct Evaluate {
  std::string name, plot;
  std::vector<std::string> dataset;
  std::int64_t modes = 0, samples = 20, seed = 1, folds = 0;
  JobFlags flags;

  void declare(Arguments& arguments) {
    arguments.positional("NAME", name, "The model, NAME or NAME@VERSION");
    arguments.option("--dataset", dataset, "D", "A dataset on the daemon, or mesh files (the training shapes)");
    arguments.option("--modes", modes, "J", "Evaluate 1 to J modes (1, 2, 3, 5, 8, 12, ... and all)");
    arguments.option("--samples", samples, "N", "Random shapes for the specificity (20)");
    arguments.option("--folds", folds, "F", "Leave every F-th shape out instead of one at a time: F trainings");
    arguments.option("--seed", seed, "S", "Of the random shapes (1)");
    arguments.option("--plot", plot, "P.svg", "Draw the three measures over the number of modes");
    flags.declare(arguments);
  }

  ExitCode run(const Session& session) const {
    const auto channel = session.channel();
    v1::EvaluateRequest request;
    *request.mutable_model() = parseModel(name);
    request.set_dataset(datasetName(channel, session));
    for (std::uint32_t j = 1; j <= countOf("--modes", modes); ++j) request.add_modes(j);
    request.set_specificity_samples(countOf("--samples", samples));
    request.set_seed(countOf("--seed", seed));
    request.set_folds(countOf("--folds", folds));
    if (flags.any()) return runAsJob(session, request);
    client::Call call(session.callOptions());
    v1::EvaluateResponse response;
    client::require(v1::Shapes::NewStub(channel)->Evaluate(call.context(), request, &response));
    if (!plot.empty()) writeFile(plot, evaluationPlot(response));
    printEvaluation(response, session);
    return exitCodeOf(response.report());
  }

 private:
  ExitCode runAsJob(const Session& session, const v1::EvaluateRequest& request) const {
    JobResultOutput output({{}, {}, plot});
    return runBatch(session, flags, output, [&](v1::Jobs::Stub& jobs, ProgressBar&) {
      v1::EvaluateJobRequest wanted;
      *wanted.mutable_evaluate() = request;
      return client::startEvaluation(jobs, wanted, session.callOptions());
    });
  }

  /// Mesh files are uploaded first; a single word that is no file names a dataset.
  std::string datasetName(const std::shared_ptr<grpc::Channel>& channel, const Session& session) const {
    if (dataset.empty()) return "";
    if (dataset.size() == 1 && !std::filesystem::exists(dataset.front())) return dataset.front();
    const client::ShapeSource shapes(dataset);
    const auto content_name = client::contentName(shapes, "evaluation");
    ProgressBar bar;
    const auto count = static_cast<double>(shapes.count());
    return client::uploadDataset(channel, content_name, shapes, session.callOptions(),
                                 [&](std::int64_t sent) { bar.show(static_cast<double>(sent) / count, "uploading"); })
        .name();
  }
};

}  // namespace

Verb evaluateVerb() { return makeVerb<Evaluate>("evaluate", "Measure how good a model is per number of modes"); }

}  // namespace shaped::shapectl
