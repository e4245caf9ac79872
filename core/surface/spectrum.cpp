#include "core/surface/spectrum.h"

#include <Spectra/SymEigsSolver.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include "core/numerics/error.h"
#include "core/numerics/long_piece.h"
#include "core/numerics/scalar_cholesky.h"
#include "core/surface/laplacian.h"

namespace shaped {
namespace {

constexpr int kAlwaysDense = 256;
constexpr double kSearchTolerance = 1e-10;  ///< of the inverse's eigenvalues, relative
constexpr double kSameEigenvalue = 1e-8;    ///< relative

/// The symmetric problem M^-1/2 L M^-1/2 y = lambda y, with phi = M^-1/2 y.
struct SymmetricProblem {
  Eigen::SparseMatrix<double> stiffness;
  Eigen::VectorXd areas, roots;  ///< M and M^1/2
  double shift;                  ///< s [1/m^2]

  SymmetricProblem(const Topology& topology, const Vertices& shape)
      : stiffness(cotangentStiffness(shape, topology.faces())),
        areas(lumpedAreas(shape, topology.faces())),
        roots(areas.cwiseSqrt()),
        shift(1 / areas.sum()) {}
};

/// Orthonormal eigenvectors y, one a column, and their eigenvalues, in the order found.
struct EigenPairs {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;

  void append(const Eigen::VectorXd& more_values, const Eigen::MatrixXd& more_vectors) {
    const auto before = values.size(), after = before + more_values.size();
    values.conservativeResize(after);
    vectors.conservativeResize(Eigen::NoChange, after);
    values.tail(more_values.size()) = more_values;
    vectors.rightCols(more_values.size()) = more_vectors;
  }

  /// The n-th smallest eigenvalue, n from 1; infinite where there are fewer.
  double smallest(Eigen::Index n) const {
    if (n > values.size()) return std::numeric_limits<double>::infinity();
    std::vector<double> sorted(values.begin(), values.end());
    std::nth_element(sorted.begin(), sorted.begin() + (n - 1), sorted.end());
    return sorted[static_cast<std::size_t>(n - 1)];
  }
};

/// The functions constant on one component and zero elsewhere, of the first `count` components.
EigenPairs constants(const Topology& topology, const SymmetricProblem& problem, std::int32_t count) {
  Eigen::MatrixXd vectors = Eigen::MatrixXd::Zero(problem.areas.size(), count);
  for (std::int32_t v = 0; v < topology.vertexCount(); ++v)
    if (topology.components()[v] < count) vectors(v, topology.components()[v]) = problem.roots[v];
  vectors.colwise().normalize();
  return {Eigen::VectorXd::Zero(count), vectors};
}

/// Thrown through Spectra once the stop token has fired.
struct Stopped {};

/// P M^1/2 (L + s M)^-1 M^1/2 P, where P projects out the pairs found: what Spectra iterates.
class ShiftedInverse {
 public:
  using Scalar = double;

  ShiftedInverse(const SymmetricProblem& problem, const EigenPairs& found, const std::stop_token& stop)
      : roots_(problem.roots), found_(found), stop_(stop) {
    Eigen::SparseMatrix<double> shifted = problem.stiffness;
    for (Eigen::Index v = 0; v < shifted.rows(); ++v) shifted.coeffRef(v, v) += problem.shift * problem.areas[v];
    definite_ = factor_.compute(shifted, stop);
  }

  bool definite() const { return definite_; }
  Eigen::Index rows() const { return roots_.size(); }
  Eigen::Index cols() const { return roots_.size(); }

  void perform_op(const double* in, double* out) const {
    if (stop_.stop_requested()) throw Stopped();
    const Eigen::VectorXd x = besideFound(Eigen::Map<const Eigen::VectorXd>(in, rows()));
    Eigen::Map<Eigen::VectorXd>(out, rows()) = besideFound(apply(x));
  }

  /// M^1/2 (L + s M)^-1 M^1/2 of each column.
  Eigen::MatrixXd apply(const Eigen::MatrixXd& x) const {
    return roots_.asDiagonal() * factor_.solve(roots_.asDiagonal() * x);
  }

  Eigen::VectorXd besideFound(const Eigen::VectorXd& x) const {
    return x - found_.vectors * (found_.vectors.transpose() * x);
  }

 private:
  const Eigen::VectorXd& roots_;
  const EigenPairs& found_;
  std::stop_token stop_;
  ScalarCholesky factor_;
  bool definite_ = false;
};

/// Another one for each search: of functions that share an eigenvalue a search meets the one in its start vector alone.
Eigen::VectorXd startVector(Eigen::Index size, unsigned seed) {
  std::minstd_rand random(seed);
  return Eigen::VectorXd::NullaryExpr(size, [&] { return static_cast<double>(random()) / random.max() - 0.5; });
}

/// One search beside what was found, to which it adds the `count` lowest pairs. False when it did not get as far.
bool search(ShiftedInverse& inverse, double shift, Eigen::Index count, int max_restarts, EigenPairs& found,
            int& restarts) {
  const auto left = inverse.rows() - found.values.size();
  count = std::min(count, left / 2);
  const auto subspace = std::min(left, count + std::max<Eigen::Index>(64, count));
  Spectra::SymEigsSolver<ShiftedInverse> solver(inverse, count, subspace);
  const Eigen::VectorXd start =
      inverse.besideFound(startVector(inverse.rows(), static_cast<unsigned>(found.values.size())));
  solver.init(start.data());
  solver.compute(Spectra::SortRule::LargestAlge, max_restarts, kSearchTolerance);
  restarts += static_cast<int>(solver.num_iterations());
  found.append(solver.eigenvalues().cwiseInverse().array() - shift, solver.eigenvectors());
  return solver.info() == Spectra::CompInfo::Successful;
}

/// Searches until nothing more turns up below the eigenvalue of number `count`.
Outcome searchAll(const SymmetricProblem& problem, const SpectrumOptions& options, const std::stop_token& stop,
                  EigenPairs& found) {
  Outcome outcome;
  ShiftedInverse inverse(problem, found, stop);
  if (!inverse.definite()) {
    outcome.termination = stop.stop_requested() ? Termination::kCancelled : Termination::kNumericalFailure;
    return outcome;
  }
  Eigen::Index again = 1;
  outcome.termination = Termination::kIterationLimit;
  for (int searches = 0; searches < options.max_searches && found.values.size() + 1 < inverse.rows(); ++searches) {
    const auto before = found.values.size();
    const double last = found.smallest(options.count);
    const auto missing = std::max<Eigen::Index>(options.count - before, again);
    if (!search(inverse, problem.shift, missing, options.max_restarts, found, outcome.iterations)) break;
    if (found.values.tail(found.values.size() - before).minCoeff() >= (1 - kSameEigenvalue) * last) {
      outcome.termination = Termination::kConverged;
      break;
    }
    if (searches > 0) again *= 4;  // a surface that repeats itself: more may be missing
  }
  return outcome;
}

/// All of a small mesh. The constants are moved to the upper end, out of the way.
void solveDensely(const SymmetricProblem& problem, EigenPairs& found) {
  const LongPiece piece("dense eigenvalues");
  const Eigen::VectorXd inverse_roots = problem.roots.cwiseInverse();
  Eigen::MatrixXd matrix = inverse_roots.asDiagonal() * Eigen::MatrixXd(problem.stiffness) * inverse_roots.asDiagonal();
  const double above = 2 * matrix.cwiseAbs().colwise().sum().maxCoeff();
  matrix += above * found.vectors * found.vectors.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(matrix);
  const auto rest = matrix.rows() - found.values.size();
  found.append(eigen.eigenvalues().head(rest), eigen.eigenvectors().leftCols(rest));
}

/// Adds what is missing to the constants.
Outcome complete(const SymmetricProblem& problem, const SpectrumOptions& options, const std::stop_token& stop,
                 EigenPairs& found) {
  try {
    if (stop.stop_requested()) throw Stopped();
    if (problem.areas.size() > std::max(kAlwaysDense, 4 * options.count))
      return searchAll(problem, options, stop, found);
    solveDensely(problem, found);
    return {};
  } catch (const Stopped&) {
    return {Termination::kCancelled, 0, 0};
  }
}

void chooseSign(Eigen::Ref<Eigen::VectorXd> function) {
  const double half = function.cwiseAbs().maxCoeff() / 2;
  const auto first = std::find_if(function.begin(), function.end(), [&](double u) { return std::abs(u) > half; });
  if (*first < 0) function = -function;
}

/// The `count` lowest pairs in ascending order, as functions.
SurfaceSpectrum lowest(const SymmetricProblem& problem, const EigenPairs& found, Eigen::Index count) {
  std::vector<Eigen::Index> order(static_cast<std::size_t>(found.values.size()));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return found.values[a] < found.values[b]; });
  order.resize(static_cast<std::size_t>(std::min(count, found.values.size())));
  SurfaceSpectrum spectrum{found.values(order),
                           problem.roots.cwiseInverse().asDiagonal() * found.vectors(Eigen::all, order), problem.areas};
  for (auto function : spectrum.eigenfunctions.colwise()) chooseSign(function);
  return spectrum;
}

double residual(const SymmetricProblem& problem, const SurfaceSpectrum& spectrum) {
  const auto& [values, functions, areas] = spectrum;
  const Eigen::MatrixXd gap = problem.stiffness * functions - areas.asDiagonal() * functions * values.asDiagonal();
  const double scale = std::max(values[values.size() - 1], problem.shift);
  return (problem.roots.cwiseInverse().asDiagonal() * gap).colwise().norm().maxCoeff() / scale;
}

}  // namespace

std::optional<std::string> SpectrumOptions::firstViolation(std::int32_t vertex_count) const {
  if (count < 1 || count > vertex_count)
    return "count = " + std::to_string(count) + ", want 1 to " + std::to_string(vertex_count);
  if (!(tolerance > 0)) return "tolerance = " + std::to_string(tolerance) + ", want > 0";
  if (max_restarts < 1) return "max_restarts = " + std::to_string(max_restarts) + ", want >= 1";
  if (max_searches < 2) return "max_searches = " + std::to_string(max_searches) + ", want >= 2";
  return std::nullopt;
}

Solved<SurfaceSpectrum> surfaceSpectrum(const Topology& topology, const Vertices& shape, const SpectrumOptions& options,
                                        const std::stop_token& stop) {
  requireValidShape(topology, shape, "shape");
  if (const auto violation = options.firstViolation(topology.vertexCount())) throw InvalidInput("options", *violation);
  const SymmetricProblem problem(topology, shape);
  auto found = constants(topology, problem, std::min(topology.componentCount(), options.count));
  auto outcome = options.count > topology.componentCount() ? complete(problem, options, stop, found) : Outcome();
  auto spectrum = lowest(problem, found, options.count);
  outcome.residual = residual(problem, spectrum);
  if (outcome.converged() && outcome.residual > options.tolerance) outcome.termination = Termination::kStalled;
  return {std::move(spectrum), outcome};
}

}  // namespace shaped
