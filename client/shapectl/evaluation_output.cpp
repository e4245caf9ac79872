#include "client/shapectl/evaluation_output.h"

#include <iostream>

#include "client/shapectl/answer.h"
#include "core/rendering/svg_plot.h"

namespace shaped::shapectl {
namespace {

nlohmann::json toJson(const v1::GeneralisationError& error) {
  return {{"elastic", error.elastic()}, {"vertex", error.vertex()}};
}

using Values = google::protobuf::RepeatedField<double>;

LinePlot plotOf(const v1::EvaluateResponse& response) {
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

}  // namespace

std::string evaluationPlot(const v1::EvaluateResponse& response) { return svgPlot(plotOf(response)); }

void printEvaluation(const v1::EvaluateResponse& response, const Session& session) {
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

}  // namespace shaped::shapectl
