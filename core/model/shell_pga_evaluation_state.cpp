#include "core/io/sealed_tensors.h"
#include "core/model/shell_pga_evaluation.h"
#include "core/model/state_tensors.h"

namespace shaped {
namespace {

constexpr const char* kFormat = "shell_pga_evaluation_state 1";

/// m x 2: elastic, vertex.
Eigen::MatrixXd matrixOf(const std::vector<GeneralisationError>& errors) {
  Eigen::MatrixXd matrix(std::ssize(errors), 2);
  for (std::size_t m = 0; m < errors.size(); ++m)
    matrix.row(static_cast<Eigen::Index>(m)) << errors[m].elastic, errors[m].vertex;
  return matrix;
}

std::vector<GeneralisationError> errorsIn(const Eigen::MatrixXd& matrix) {
  std::vector<GeneralisationError> errors;
  for (const auto& row : matrix.rowwise()) errors.push_back({row[0], row[1]});
  return errors;
}

void addColumn(const std::string& name, const std::vector<double>& values, TensorWriter& file) {
  file.add(name, {std::ssize(values), 1}, std::span<const double>(values));
}

std::vector<double> columnIn(const TensorFile& file, const std::string& name) {
  const auto values = file.values<double>(name);
  return {values.begin(), values.end()};
}

}  // namespace

void writeEvaluationState(const std::filesystem::path& path, const ShellPgaEvaluationState& state) {
  TensorWriter file;
  addSpider("spider", state.spider, file);
  file.addMatrix("outcome", numbersOf(state.outcome));
  file.addMatrix("folds", Eigen::Matrix<std::int64_t, 1, 1>(std::int64_t{state.folds}));
  file.add("modes", {std::ssize(state.sums.modes), 1}, std::span<const std::int32_t>(state.sums.modes));
  addColumn("compactness", state.sums.compactness, file);
  file.addMatrix("generalisation", matrixOf(state.sums.generalisation));
  file.addMatrix("linear", matrixOf(state.sums.linear));
  addColumn("specificity", state.sums.specificity, file);
  writeSealed(path, file, kFormat);
}

ShellPgaEvaluationState readEvaluationState(const std::filesystem::path& path) {
  const TensorFile file(path);
  requireSealed(file, path, kFormat);
  const auto modes = file.values<std::int32_t>("modes");
  return {readSpider(file, "spider"),
          outcomeOf(file.matrix<double>("outcome", 1, 3)),
          static_cast<int>(file.values<std::int64_t>("folds")[0]),
          {{modes.begin(), modes.end()},
           columnIn(file, "compactness"),
           errorsIn(file.matrix<double>("generalisation", -1, 2)),
           errorsIn(file.matrix<double>("linear", -1, 2)),
           columnIn(file, "specificity")}};
}

}  // namespace shaped
