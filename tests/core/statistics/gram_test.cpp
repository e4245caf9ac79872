#include "core/statistics/gram.h"

#include <Eigen/Eigenvalues>
#include <catch2/catch.hpp>

#include "tests/support/literal_shell_energy.h"
#include "tests/support/training_set.h"

using namespace shaped;
using namespace shaped::test;

namespace {

/// g(u, u) at s: half the second derivative of the literal W[s, .] along u.
double metric(const TrainingSet& set, const Vertices& s, const Vertices& u) {
  const double h = 2e-3 / u.rowwise().norm().maxCoeff();
  const auto along = [&](double t) {
    return literalShellEnergy(*set.mesh.topology, s, s + t * u, set.calculus->bending());
  };
  const double near = along(h) + along(-h), far = along(2 * h) + along(-2 * h);
  return 0.5 * (16 * near - far) / (12 * h * h);
}

/// The Gram matrix of linear PCA in the metric at s: <d_i - mean, d_j - mean> / n.
Eigen::MatrixXd linearGram(const TrainingSet& set, const Vertices& s, const std::vector<Vertices>& displacements) {
  const auto n = static_cast<Eigen::Index>(displacements.size());
  Vertices centre = Vertices::Zero(s.rows(), 3);
  for (const auto& d : displacements) centre += d / static_cast<double>(n);
  Eigen::MatrixXd gram(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) {
      const Vertices u = displacements[static_cast<std::size_t>(i)] - centre,
                     v = displacements[static_cast<std::size_t>(j)] - centre;
      gram(i, j) = 0.25 * (metric(set, s, u + v) - (i == j ? 0.0 : metric(set, s, u - v))) / static_cast<double>(n);
    }
  return gram;
}

/// Errors of K = 2, 4, 8 against K = 16, as in Fig. 3 of the paper.
struct Convergence {
  std::vector<double> gram, eigenvalues;
};

Convergence convergenceOf(const TrainingSet& set, Eigen::Index eigenvalues) {
  const Eigen::MatrixXd exact = gramMatrix(*set.calculus, set.spider(16));
  const Eigen::VectorXd exact_values = spectrum(exact).values.head(eigenvalues);
  Convergence result;
  for (const int steps : {2, 4, 8}) {
    const Eigen::MatrixXd gram = gramMatrix(*set.calculus, set.spider(steps));
    result.gram.push_back((gram - exact).norm() / exact.norm());
    const Eigen::VectorXd values = spectrum(gram).values.head(eigenvalues);
    result.eigenvalues.push_back((values.cwiseQuotient(exact_values).array() - 1).matrix().norm());
  }
  return result;
}

}  // namespace

TEST_CASE("the Gram matrix is symmetric and, in the limit, centred and positive semi-definite") {
  const auto set = variedTubes();
  std::vector<double> row_sums, negative;
  for (const int steps : {2, 4, 8}) {
    const auto gram = gramMatrix(*set.calculus, set.spider(steps));
    CHECK(gram == gram.transpose());
    CHECK(gram.diagonal().minCoeff() > 0);
    row_sums.push_back(gram.rowwise().sum().norm() / gram.norm());
    negative.push_back(std::abs(spectrum(gram).values.tail(1)[0]) / gram.norm());
  }
  CHECK(row_sums[0] < 0.1);
  for (std::size_t k = 1; k < row_sums.size(); ++k) {
    CHECK(order(row_sums[k - 1], row_sums[k]) > 0.8);
    CHECK(order(negative[k - 1], negative[k]) > 1.5);
  }
}

TEST_CASE("for small deformations the Gram matrix is that of linear PCA in the shell metric") {
  auto set = variedTubes();
  const Vertices base = bend(set.mesh.vertices, 0.7);
  std::vector<Vertices> directions;
  for (unsigned i = 0; i < 4; ++i) directions.push_back(jitter(Vertices::Zero(base.rows(), 3), 1, 30 + i));
  std::vector<double> errors;
  for (const double size : {4e-3, 2e-3, 1e-3}) {
    set.shapes.clear();
    std::vector<Vertices> displacements;
    for (unsigned i = 0; i < directions.size(); ++i) {
      displacements.push_back(size * directions[i]);
      set.shapes.push_back(moveRigidly(base + displacements.back(), i));
    }
    const auto linear = linearGram(set, base, displacements);
    errors.push_back((gramMatrix(*set.calculus, set.spider(2)) - linear).norm() / linear.norm());
  }
  CHECK(errors.back() < 0.01);
  for (std::size_t k = 1; k < errors.size(); ++k) CHECK(order(errors[k - 1], errors[k]) > 0.8);
}

TEST_CASE("rigid motions of every training shape change eigenvalues by at most 1e-6") {
  const auto set = variedTubes();
  const auto still = spectrum(gramMatrix(*set.calculus, set.spider(4)));
  auto moved = set;
  for (unsigned i = 0; i < moved.shapes.size(); ++i) moved.shapes[i] = moveRigidly(moved.shapes[i], 90 + i);
  const auto other = spectrum(gramMatrix(*moved.calculus, moved.spider(4)));
  for (Eigen::Index j = 0; j < 4; ++j) {
    CHECK(other.values[j] == Approx(still.values[j]).epsilon(1e-6));
    CHECK((other.vectors.col(j) - still.vectors.col(j)).norm() < 1e-5);
  }
}

TEST_CASE("the order of the training shapes permutes the Gram matrix and leaves its eigenvalues") {
  auto set = variedTubes();
  const auto gram = gramMatrix(*set.calculus, set.spider(2));
  const std::vector<Eigen::Index> order{2, 4, 0, 1, 3};
  const auto shapes = set.shapes;
  for (std::size_t i = 0; i < order.size(); ++i) set.shapes[i] = shapes[static_cast<std::size_t>(order[i])];
  const auto shuffled = gramMatrix(*set.calculus, set.spider(2));
  CHECK((shuffled - gram(order, order)).norm() < 1e-6 * gram.norm());
}

TEST_CASE("Gram entries and eigenvalues converge in K") {
  // W[s, s~] and W[s~, s] differ in third order, which leaves a first-order term where shapes are stretched
  for (const auto& [set, eigenvalues] : {std::pair{variedTubes(), 4}, std::pair{bentTubes(), 1}}) {
    const auto errors = convergenceOf(set, eigenvalues);
    for (const auto* list : {&errors.gram, &errors.eigenvalues}) {
      CHECK(list->back() < 0.01);
      CHECK(0.5 * order(list->front(), list->back()) > 1.2);  // mean slope over two halvings
    }
  }
}

TEST_CASE("a spectrum is orthonormal, falling, signed by its largest entries, and rebuilds its matrix") {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Random(6, 6);
  matrix = (matrix + matrix.transpose()).eval();
  const auto result = spectrum(matrix);
  CHECK((result.vectors.transpose() * result.vectors - Eigen::MatrixXd::Identity(6, 6)).norm() < 1e-13);
  CHECK((result.vectors * result.values.asDiagonal() * result.vectors.transpose() - matrix).norm() < 1e-13);
  for (Eigen::Index j = 0; j < 6; ++j) {
    if (j > 0) CHECK(result.values[j] <= result.values[j - 1]);
    CHECK(result.vectors.col(j).maxCoeff() == result.vectors.col(j).cwiseAbs().maxCoeff());
  }
}
