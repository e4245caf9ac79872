#include <filesystem>

#include "client/dataset_upload.h"
#include "client/shapectl/answer.h"
#include "client/shapectl/numbers.h"
#include "client/shapectl/progress_bar.h"
#include "client/shapectl/verbs/verbs.h"
#include "core/io/file.h"
#include "core/rendering/svg_plot.h"
#include "shaped/v1/shapes.grpc.pb.h"

namespace shaped::shapectl {
namespace {

nlohmann::json toJson(const v1::GeneralisationError& error) {
  return {{"elastic", error.elastic()}, {"vertex", error.vertex()}};
}

using Values = google::protobuf::RepeatedField<double>;

struct Evaluate {
  std::string name, plot;
  std::vector<std::string> dataset;
  std::int64_t modes = 0, samples = 20, seed = 1, folds = 0;

  void declare(Arguments& arguments) {
    arguments.positional("NAME", name, "The model, NAME or NAME@VERSION");
    arguments.option("--dataset", dataset, "D", "A dataset on the daemon, or mesh files (the training shapes)");
    arguments.option("--modes", modes, "J", "Evaluate 1 to J modes (1, 2, 3, 5, 8, 12, ... and all)");
    arguments.option("--samples", samples, "N", "Random shapes for the specificity (20)");
    arguments.option("--folds", folds, "F", "Leave every F-th shape out instead of one at a time: F trainings");
    arguments.option("--seed", seed, "S", "Of the random shapes (1)");
    arguments.option("--plot", plot, "P.svg", "Draw the three measures over the number of modes");
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
    client::Call call(session.callOptions());
    v1::EvaluateResponse response;
    client::require(v1::Shapes::NewStub(channel)->Evaluate(call.context(), request, &response));
    if (!plot.empty()) writeFile(plot, svgPlot(plotOf(response)));
    print(response, session);
    return exitCodeOf(response.report());
  }

 private:
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

  static LinePlot plotOf(const v1::EvaluateResponse& response) {
    // Errors in millimetres and the share in percent meet on one axis of like numbers.
    const auto series = [&](const char* label, const Values& values, double factor) {
      PlotSeries line{label, {}, {}};
      for (int i = 0; i < values.size(); ++i) {
        line.x.push_back(response.modes(i));
        line.y.push_back(factor * values[i]);
      }
      return line;
    };
    constexpr double millimetres = 1000, percent = 100;
    return {.title = modelText(response.model()),
            .x_label = "modes",
            .y_label = "compactness [%], errors [mm]",
            .series = {series("compactness [%]", response.compactness(), percent),
                       series("generalisation [mm]", response.generalisation().vertex(), millimetres),
                       series("linear PCA's [mm]", response.linear_generalisation().vertex(), millimetres),
                       series("specificity [mm]", response.specificity(), millimetres)}};
  }

  static void print(const v1::EvaluateResponse& response, const Session& session) {
    if (session.json) {
      auto document = documentOf(response);
      document["modes"] = response.modes();
      document["compactness"] = response.compactness();
      document["generalisation"] = toJson(response.generalisation());
      document["linear_generalisation"] = toJson(response.linear_generalisation());
      document["specificity"] = response.specificity();
      return printJson(document);
    }
    std::cout << answerText(response)
              << "\nmodes  compactness  generalisation [mm]  of linear PCA [mm]  specificity [mm]\n";
    for (int i = 0; i < response.modes_size(); ++i)
      std::cout << response.modes(i) << "  " << response.compactness(i) << "  "
                << 1000 * response.generalisation().vertex(i) << "  "
                << 1000 * response.linear_generalisation().vertex(i) << "  " << 1000 * response.specificity(i) << "\n";
  }
};

}  // namespace

Verb evaluateVerb() { return makeVerb<Evaluate>("evaluate", "Measure how good a model is per number of modes"); }

}  // namespace shaped::shapectl
