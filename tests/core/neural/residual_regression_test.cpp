#include "core/neural/residual_regression.h"

#include <Eigen/Cholesky>
#include <catch2/catch.hpp>

#include "core/numerics/error.h"
#include "core/sample/random.h"

using namespace shaped;
using Catch::Matchers::Contains;

namespace {

constexpr Eigen::Index kVertices = 40, kCoefficients = 7;

Eigen::VectorXd normals(Eigen::Index count, Random& random) {
  Eigen::VectorXd values(count);
  for (auto& value : values) value = random.normal();
  return values;
}

/// Bodies whose residual is a linear function of what is seen of it, but for some noise; two examples of each.
std::vector<ResidualExample> linearExamples(int subjects, double noise, std::uint64_t seed) {
  Random fixed(11), random(seed);
  Eigen::MatrixXd from_offsets(3 * kVertices, 2), from_state(3 * kVertices, 2), shown(kVertices, 2);
  for (auto* matrix : {&from_offsets, &from_state, &shown})
    for (Eigen::Index c = 0; c < 2; ++c) matrix->col(c) = normals(matrix->rows(), fixed);
  const Eigen::VectorXd mean = normals(3 * kVertices, fixed);
  std::vector<ResidualExample> examples;
  for (int s = 0; s < subjects; ++s) {
    const Eigen::VectorXd code = normals(2, random), state = normals(kCoefficients, random);
    for (int copy = 0; copy < 2; ++copy) {
      const Eigen::VectorXd residual =
          0.004 * (mean + from_offsets * code + from_state * state.head(2)) + noise * normals(3 * kVertices, random);
      examples.push_back({{0.003 * shown * code + 0.1 * noise * normals(kVertices, random), state},
                          Eigen::Map<const Vertices>(residual.data(), kVertices, 3),
                          std::size_t(s)});
    }
  }
  return examples;
}

Eigen::VectorXd evenAreas() { return Eigen::VectorXd::Constant(kVertices, 0.5); }

double rms(const Vertices& left) { return std::sqrt(left.squaredNorm() / double(left.rows())); }

}  // namespace

TEST_CASE("a residual that depends linearly on what is seen is learned for bodies not seen") {
  const auto fitted = fitResiduals(linearExamples(40, 1e-5, 1), evenAreas());
  REQUIRE(fitted.weights);
  CHECK(fitted.after < 0.1 * fitted.before);
  const ResidualRegression regression(*fitted.weights);
  for (const auto& example : linearExamples(5, 1e-5, 2))
    CHECK(rms(regression.predict(example.evidence) - example.residual) < 0.15 * rms(example.residual));
}

TEST_CASE("what is held out is what a regression without that body predicts") {
  ResidualRegressionOptions options;
  options.kept = 1;
  const auto examples = linearExamples(6, 1e-4, 3);
  const auto fitted = fitResiduals(examples, evenAreas(), options);
  REQUIRE(fitted.weights);
  // The same ridge regression written out: n x n kernel of the ten others, residuals as they are.
  const Eigen::Index count = std::ssize(examples), values = 3 * kVertices;
  const auto product = [&](const FitEvidence& a, const FitEvidence& b) {
    return a.offsets.dot(b.offsets) / double(kVertices) / std::pow(options.offset_scale, 2) +
           options.state_share * a.state.dot(b.state) / double(kCoefficients);
  };
  double unit = 0;
  for (const auto& example : examples) unit += product(example.evidence, example.evidence) / double(count);
  Eigen::MatrixXd kernel(count - 2, count - 2), residuals(count - 2, values);
  for (Eigen::Index i = 2; i < count; ++i) {
    residuals.row(i - 2) = Eigen::Map<const Eigen::RowVectorXd>(examples[std::size_t(i)].residual.data(), values);
    for (Eigen::Index j = 2; j < count; ++j)
      kernel(i - 2, j - 2) = product(examples[std::size_t(i)].evidence, examples[std::size_t(j)].evidence) + 10 * unit +
                             (i == j ? fitted.penalty * unit : 0);
  }
  Eigen::VectorXd first(count - 2);
  for (Eigen::Index i = 2; i < count; ++i)
    first[i - 2] = product(examples[std::size_t(i)].evidence, examples[0].evidence) + 10 * unit;
  const Eigen::VectorXd expected = residuals.transpose() * kernel.ldlt().solve(first);
  CHECK((Eigen::Map<const Eigen::VectorXd>(fitted.held_out[0].data(), values) - expected).cwiseAbs().maxCoeff() <
        1e-12);
}

TEST_CASE("a regression that would not help other bodies is none") {
  Random random(5);
  std::vector<ResidualExample> examples;
  for (std::size_t i = 0; i < 12; ++i) {
    const Eigen::VectorXd residual = 0.004 * normals(3 * kVertices, random);
    examples.push_back({{0.003 * normals(kVertices, random), normals(kCoefficients, random)},
                        Eigen::Map<const Vertices>(residual.data(), kVertices, 3),
                        i});
  }
  const auto fitted = fitResiduals(examples, evenAreas());
  CHECK_FALSE(fitted.weights);
  CHECK(fitted.after == fitted.before);
  for (const auto& held_out : fitted.held_out) CHECK(held_out.isZero(0));
  CHECK_FALSE(fitResiduals(linearExamples(2, 1e-5, 1), evenAreas()).weights);
}

TEST_CASE("examples and weights that do not fit are refused by name") {
  auto examples = linearExamples(4, 1e-4, 1);
  examples[3].residual = Vertices::Zero(kVertices + 1, 3);
  CHECK_THROWS_WITH(fitResiduals(examples, evenAreas()), Contains("examples[3]"));
  ResidualRegressionOptions options;
  options.kept = 0;
  CHECK_THROWS_WITH(fitResiduals(linearExamples(4, 1e-4, 1), evenAreas(), options), Contains("kept = 0"));
  auto weights = *fitResiduals(linearExamples(20, 1e-5, 1), evenAreas()).weights;
  CHECK_THROWS_WITH(ResidualRegression(weights).predict({Eigen::VectorXd::Zero(3), {}}), Contains("evidence"));
  weights.mean.conservativeResize(5);
  CHECK_THROWS_WITH(ResidualRegression(weights), Contains("mean"));
}
