#include "core/neural/residual_regression.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "core/numerics/error.h"
#include "core/numerics/option_checks.h"

namespace shaped {
namespace {

constexpr std::size_t kFewestSubjects = 3;
/// Of the mean square of the inputs: what a constant input counts for, so that the mean residual is hardly penalised.
constexpr double kConstantInput = 10;
constexpr std::array kPenalties{0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0};

std::string extent(Eigen::Index rows, Eigen::Index columns) {
  return std::to_string(rows) + " x " + std::to_string(columns);
}

template <class Matrix>
void requirePart(const char* name, const Matrix& matrix, Eigen::Index rows, Eigen::Index columns) {
  if (matrix.rows() != rows || matrix.cols() != columns)
    throw InvalidInput(name, "is " + extent(matrix.rows(), matrix.cols()) + ", want " + extent(rows, columns));
  if (!matrix.allFinite()) throw InvalidInput(name, "holds a number that is not finite");
}

void requireExamples(const std::vector<ResidualExample>& examples, Eigen::Index vertices) {
  for (std::size_t i = 0; i < examples.size(); ++i) {
    const auto& [evidence, residual, subject] = examples[i];
    if (evidence.offsets.size() == vertices && evidence.state.size() == examples.front().evidence.state.size() &&
        residual.rows() == vertices && residual.allFinite() && evidence.offsets.allFinite() &&
        evidence.state.allFinite())
      continue;
    throw InvalidInput("examples[" + std::to_string(i) + "]",
                       "has another count of vertices or state coefficients than the others, or a number that is not "
                       "finite");
  }
}

/// The examples' inputs, scaled so that their products are a kernel: n x V and n x s.
struct Inputs {
  Eigen::MatrixXd offsets, states;
  Eigen::VectorXd offset_scales, state_scales;  ///< by which the evidence was multiplied

  Inputs(const std::vector<ResidualExample>& examples, const Eigen::VectorXd& areas,
         const ResidualRegressionOptions& options) {
    const auto count = std::ssize(examples);
    const Eigen::Index coefficients = examples.front().evidence.state.size();
    offset_scales = (areas / areas.sum()).cwiseSqrt() / options.offset_scale;
    state_scales = Eigen::VectorXd::Constant(
        coefficients, std::sqrt(options.state_share / double(std::max<Eigen::Index>(1, coefficients))));
    offsets.resize(count, areas.size());
    states.resize(count, coefficients);
    for (Eigen::Index i = 0; i < count; ++i) {
      const auto& evidence = examples[std::size_t(i)].evidence;
      offsets.row(i) = evidence.offsets.cwiseProduct(offset_scales).transpose();
      states.row(i) = evidence.state.cwiseProduct(state_scales).transpose();
    }
  }

  Eigen::MatrixXd kernel() const { return offsets * offsets.transpose() + states * states.transpose(); }
};

/// The residuals by their principal directions, the mean left in: codes (n x m) and modes (3 V x m).
struct Outputs {
  Eigen::MatrixXd codes, modes;
  double energy = 0;  ///< sum of squares of all residuals

  Outputs(const std::vector<ResidualExample>& examples, double kept) {
    Eigen::MatrixXd rows(std::ssize(examples), examples.front().residual.size());
    for (Eigen::Index i = 0; i < rows.rows(); ++i)
      rows.row(i) = Eigen::Map<const Eigen::RowVectorXd>(examples[std::size_t(i)].residual.data(), rows.cols());
    energy = rows.squaredNorm();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(rows * rows.transpose());
    const Eigen::VectorXd values = solver.eigenvalues().reverse();
    Eigen::Index count = 0;
    for (double held = 0; count < values.size() && held < kept * energy && values[count] > 0; ++count)
      held += values[count];
    const Eigen::MatrixXd directions = solver.eigenvectors().rowwise().reverse().leftCols(count);
    const Eigen::VectorXd lengths = values.head(count).cwiseSqrt();
    codes = directions * lengths.asDiagonal();
    modes = rows.transpose() * directions * lengths.cwiseInverse().asDiagonal();
  }
};

std::vector<std::vector<Eigen::Index>> bySubject(const std::vector<ResidualExample>& examples) {
  std::map<std::size_t, std::vector<Eigen::Index>> subjects;
  for (std::size_t i = 0; i < examples.size(); ++i) subjects[examples[i].subject].push_back(Eigen::Index(i));
  std::vector<std::vector<Eigen::Index>> lists;
  for (auto& [subject, list] : subjects) lists.push_back(std::move(list));
  return lists;
}

/// Ridge regression of codes on a kernel.
struct Ridge {
  Eigen::MatrixXd dual;      ///< (K + penalty)^-1 codes, n x m
  Eigen::MatrixXd held_out;  ///< predictions by regressions that have not seen the subject, n x m
  double error;              ///< sum of squares of what these leave

  /// With G = (K + penalty)^-1, leaving out the rows B changes their prediction to codes_B - (G_BB)^-1 (G codes)_B.
  Ridge(const Eigen::MatrixXd& kernel, double penalty, const Eigen::MatrixXd& codes,
        const std::vector<std::vector<Eigen::Index>>& subjects) {
    const Eigen::Index count = kernel.rows();
    const Eigen::MatrixXd inverse = (kernel + penalty * Eigen::MatrixXd::Identity(count, count))
                                        .llt()
                                        .solve(Eigen::MatrixXd::Identity(count, count));
    dual = inverse * codes;
    held_out = codes;
    for (const auto& rows : subjects) {
      const Eigen::MatrixXd left = inverse(rows, rows).llt().solve(dual(rows, Eigen::all));
      held_out(rows, Eigen::all) -= left;
    }
    error = (codes - held_out).squaredNorm();
  }
};

Vertices shapeOf(const Eigen::VectorXd& flat) { return Eigen::Map<const Vertices>(flat.data(), flat.size() / 3, 3); }

}  // namespace

ResidualRegression::ResidualRegression(ResidualRegressionWeights weights) : weights_(std::move(weights)) {
  const Eigen::Index vertices = weights_.offset_weights.rows(), modes = weights_.modes.cols();
  requirePart("offset_weights", weights_.offset_weights, vertices, modes);
  requirePart("state_weights", weights_.state_weights, weights_.state_weights.rows(), modes);
  requirePart("mean", weights_.mean, 3 * vertices, 1);
  requirePart("modes", weights_.modes, 3 * vertices, modes);
}

Vertices ResidualRegression::predict(const FitEvidence& evidence) const {
  if (evidence.offsets.size() != weights_.offset_weights.rows() ||
      evidence.state.size() != weights_.state_weights.rows())
    throw InvalidInput("evidence", "has " + std::to_string(evidence.offsets.size()) + " offsets and " +
                                       std::to_string(evidence.state.size()) + " state coefficients, want " +
                                       std::to_string(weights_.offset_weights.rows()) + " and " +
                                       std::to_string(weights_.state_weights.rows()));
  const Eigen::VectorXf code = weights_.offset_weights.transpose() * evidence.offsets.cast<float>() +
                               weights_.state_weights.transpose() * evidence.state.cast<float>();
  return shapeOf((weights_.mean + weights_.modes * code).cast<double>());
}

std::size_t ResidualRegression::bytes() const {
  return sizeof(float) * static_cast<std::size_t>(weights_.offset_weights.size() + weights_.state_weights.size() +
                                                  weights_.mean.size() + weights_.modes.size());
}

std::optional<std::string> ResidualRegressionOptions::firstViolation() const {
  if (auto problem = unlessPositive("offset_scale", offset_scale)) return problem;
  if (!(state_share >= 0) || !std::isfinite(state_share))
    return "state_share = " + std::to_string(state_share) + ", want >= 0";
  if (!(kept > 0 && kept <= 1)) return "kept = " + std::to_string(kept) + ", want > 0 and <= 1";
  return std::nullopt;
}

FittedResiduals fitResiduals(const std::vector<ResidualExample>& examples, const Eigen::VectorXd& areas,
                             const ResidualRegressionOptions& options) {
  if (const auto problem = options.firstViolation()) throw InvalidInput("options", *problem);
  requireExamples(examples, areas.size());
  FittedResiduals fitted;
  for (const auto& example : examples)
    fitted.held_out.emplace_back(Vertices::Zero(areas.size(), 3)), fitted.before += example.residual.squaredNorm();
  const double values = double(examples.size()) * double(areas.size());
  const auto rootMean = [values](double sum) { return values > 0 ? std::sqrt(sum / values) : 0; };
  const double energy = std::exchange(fitted.before, rootMean(fitted.before));
  fitted.after = fitted.before;
  const auto subjects = bySubject(examples);
  if (subjects.size() < kFewestSubjects || energy == 0) return fitted;

  const Inputs inputs(examples, areas, options);
  const Outputs outputs(examples, options.kept);
  const Eigen::MatrixXd kernel = inputs.kernel();
  const double unit = kernel.trace() / double(kernel.rows());
  if (!(unit > 0)) return fitted;
  const double constant = kConstantInput * unit;
  std::optional<Ridge> best;
  for (const double penalty : kPenalties) {
    Ridge ridge((kernel.array() + constant).matrix(), penalty * unit, outputs.codes, subjects);
    if (best && ridge.error >= best->error) continue;
    best = std::move(ridge);
    fitted.penalty = penalty;
  }
  // What the modes leave out is left by every prediction.
  const double after = best->error + energy - outputs.codes.squaredNorm();
  if (after >= energy) return fitted;
  fitted.after = rootMean(after);
  for (std::size_t i = 0; i < examples.size(); ++i)
    fitted.held_out[i] = shapeOf(outputs.modes * best->held_out.row(Eigen::Index(i)).transpose());
  fitted.weights = ResidualRegressionWeights{
      (inputs.offset_scales.asDiagonal() * (inputs.offsets.transpose() * best->dual)).cast<float>(),
      (inputs.state_scales.asDiagonal() * (inputs.states.transpose() * best->dual)).cast<float>(),
      (outputs.modes * (constant * best->dual.colwise().sum().transpose())).cast<float>(), outputs.modes.cast<float>()};
  return fitted;
}

}  // namespace shaped
