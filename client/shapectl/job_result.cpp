#include "client/shapectl/job_result.h"

#include <iostream>

#include "client/mesh.h"
#include "client/shapectl/answer.h"
#include "client/shapectl/evaluation_output.h"
#include "client/shapectl/projection_output.h"
#include "core/io/file.h"
#include "core/numerics/error.h"

namespace shaped::shapectl {

JobResultOutput::JobResultOutput(ResultFiles files, std::vector<std::string> labels)
    : files_(std::move(files)), labels_(std::move(labels)) {}

void JobResultOutput::add(const v1::GetJobResultResponse& answer) {
  if (answer.has_evaluate()) evaluation_ = answer.evaluate();
  if (answer.has_fit_markers()) addFit(answer.fit_markers());
  if (answer.has_project()) addProjection(answer.project());
  if (answer.has_bootstrap_round()) bootstrap_.add(answer.bootstrap_round());
}

void JobResultOutput::addShape(const v1::Shape& shape) {
  if (files_.out.empty()) return;
  if (shape.positions().empty())
    throw InvalidInput("--out", "the job was asked to leave the shapes out of its answers");
  if (!shapes_) shapes_.emplace(files_.out);
  shapes_->append(client::unpack(shape.positions()));
}

void JobResultOutput::addFit(const v1::FitMarkersResponse& response) {
  if (!fit_) {
    for (auto i = labels_.size(); i < static_cast<std::size_t>(response.residuals_size()); ++i)
      labels_.push_back(std::to_string(i));
    fit_.emplace(labels_);
  }
  fit_->add(response);
  addShape(response.shape());
}

void JobResultOutput::addProjection(const v1::ProjectResponse& response) {
  projections_.add(response.report(), response.smallest_area_ratio());
  projection_documents_.push_back(projectionDocument(response));
  addShape(response.shape());
}

ExitCode JobResultOutput::finish(const Session& session) {
  if (shapes_) shapes_->close();
  if (evaluation_) {
    if (!files_.plot.empty()) writeFile(files_.plot, evaluationPlot(*evaluation_));
    printEvaluation(*evaluation_, session);
    return exitCodeOf(evaluation_->report());
  }
  if (!bootstrap_.empty()) return finishBootstrap(session);
  if (!fit_) return finishProjections(session);
  if (!files_.report.empty()) fit_->write(files_.report);
  fit_->print(session);
  return exitCodeOf(fit_->solver());
}

ExitCode JobResultOutput::finishBootstrap(const Session& session) const {
  if (!files_.report.empty()) writeFile(files_.report, bootstrap_.document().dump(2) + "\n");
  if (session.json)
    printJson(bootstrap_.document());
  else
    std::cout << bootstrap_.text();
  return ExitCode::kSuccess;
}

ExitCode JobResultOutput::finishProjections(const Session& session) const {
  const nlohmann::json document{{"shapes", projection_documents_}};
  if (!files_.report.empty()) writeFile(files_.report, document.dump(2) + "\n");
  auto summary = projections_.document();
  summary["shape_count"] = projection_documents_.size();
  if (session.json && files_.report.empty()) summary["shapes"] = projection_documents_;
  if (session.json)
    printJson(summary);
  else
    std::cout << projection_documents_.size() << " shapes: " << reportText(projections_.report())
              << ", smallest area ratio " << projections_.smallestAreaRatio() << "\n";
  return exitCodeOf(projections_.report());
}

}  // namespace shaped::shapectl
