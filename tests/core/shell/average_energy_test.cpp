#include "core/shell/average_energy.h"

#include <catch2/catch.hpp>

#include "core/shell/energy.h"
#include "tests/support/finite_differences.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;

namespace {

constexpr double kEta = 4e-3;
constexpr double kPi = 3.14159265358979323846;

/// Two triangles that share an edge, folded by `angle`: 0 is flat, +-pi lies one on the other.
Mesh hinge(double angle) {
  Vertices vertices(4, 3);
  vertices << 0, 0, 0, 1, 0, 0, 0.4, 0.9, 0, 0.6, -0.8 * std::cos(angle), -0.8 * std::sin(angle);
  Faces faces(2, 3);
  faces << 0, 1, 2, 1, 0, 3;
  return {std::make_shared<Topology>(4, faces), vertices};
}

struct Weighted {
  Vertices shape;
  double weight;
};

AverageEnergy averageOf(const Topology& topology, const std::vector<Weighted>& terms) {
  AverageEnergy average(topology);
  for (const auto& [shape, weight] : terms) average.add(topology, measure(topology, shape), kEta, weight);
  return average;
}

double sumOf(const Topology& topology, const std::vector<Weighted>& terms, const Vertices& x) {
  double sum = 0;
  for (const auto& [shape, weight] : terms) sum += weight * shellEnergy(topology, shape, x, kEta);
  return sum;
}

Vertices averageGradient(const Topology& topology, const AverageEnergy& average, const Vertices& x, double weight) {
  MeasureGradient gradient(topology);
  average.addGradient(topology, measure(topology, x), weight, gradient);
  Vertices result = Vertices::Zero(x.rows(), 3);
  pullBackGradient(topology, x, gradient, result);
  return result;
}

Vertices sumGradient(const Topology& topology, const std::vector<Weighted>& terms, const Vertices& x) {
  MeasureGradient gradient(topology);
  for (const auto& [shape, weight] : terms)
    addSecondGradient(topology, measure(topology, shape), measure(topology, x), kEta, weight, gradient);
  Vertices result = Vertices::Zero(x.rows(), 3);
  pullBackGradient(topology, x, gradient, result);
  return result;
}

Eigen::MatrixXd pulledBack(const ShellStructure& structure, const Vertices& x, const MeasureCurvature& curvature) {
  SymmetricBlockMatrix hessian(structure.pattern());
  pullBackHessian(structure, x, curvature, hessian);
  return Eigen::MatrixXd(hessian.toSparse());
}

/// Value, gradient and Hessian of the average against the literal sum at x.
void checkEqualsSum(const TopologyPtr& topology, const std::vector<Weighted>& terms, const Vertices& x) {
  const auto average = averageOf(*topology, terms);
  const double sum = sumOf(*topology, terms, x);
  CHECK(average.value(*topology, measure(*topology, x)) == Approx(sum).epsilon(1e-11).margin(1e-13));
  const Vertices expected = sumGradient(*topology, terms, x);
  CHECK((averageGradient(*topology, average, x, 1) - expected).norm() < 1e-11 * (1 + expected.norm()));
  CHECK((averageGradient(*topology, average, x, 2.5) - 2.5 * expected).norm() < 1e-11 * (1 + expected.norm()));

  const ShellStructure structure(topology);
  MeasureCurvature curvature(*topology, HessianKind::kExact), literal(*topology, HessianKind::kExact);
  average.addCurvature(*topology, measure(*topology, x), 2, curvature);
  for (const auto& [shape, weight] : terms)
    addSecondCurvature(*topology, measure(*topology, shape), measure(*topology, x), kEta, 2 * weight, literal);
  const auto hessian = pulledBack(structure, x, literal);
  CHECK((pulledBack(structure, x, curvature) - hessian).norm() < 1e-11 * hessian.norm());
}

}  // namespace

TEST_CASE("the average energy equals the weighted sum of shell energies: value, gradient and Hessian") {
  const auto pipe = tube(7, 6);
  std::vector<Weighted> terms;
  for (unsigned k = 0; k < 6; ++k) terms.push_back({jitter(bend(pipe.vertices, 0.5 * k - 1), 0.03, k), 0.1 + 0.3 * k});
  for (unsigned k = 0; k < 3; ++k)
    checkEqualsSum(pipe.topology, terms, jitter(bend(pipe.vertices, 0.8 * k), 0.05, 10 + k));
  checkEqualsSum(pipe.topology, {terms[1]}, terms[1].shape);  // one shape at rest
  const auto sheet = grid(4);
  checkEqualsSum(sheet.topology, {{sheet.vertices, 0.5}, {jitter(sheet.vertices, 0.05, 1), 2}},
                 jitter(sheet.vertices, 0.05, 2));
}

TEST_CASE("terms of weight zero add nothing, wherever they stand") {
  const auto pipe = tube(5, 5);
  const Vertices x = jitter(pipe.vertices, 0.05, 1);
  const Weighted counted{bend(pipe.vertices, 0.5), 1.5}, other{bend(pipe.vertices, -0.4), 0.5};
  const Weighted nothing{jitter(pipe.vertices, 0.1, 9), 0};
  checkEqualsSum(pipe.topology, {nothing, counted, other}, x);
  checkEqualsSum(pipe.topology, {counted, nothing, other}, x);
}

TEST_CASE("hinges folded to either side of pi average over the short way round") {
  const auto flat = hinge(0);
  for (const double spread : {0.02, 0.4})
    for (const double at : {kPi - 0.05, kPi + 0.05, -kPi + 0.3, kPi}) {
      INFO("spread " << spread << ", deformed by " << at);
      const std::vector<Weighted> terms{{hinge(kPi - spread).vertices, 1},
                                        {hinge(-kPi + 0.5 * spread).vertices, 2},
                                        {hinge(kPi - 2 * spread).vertices, 0.5}};
      checkEqualsSum(flat.topology, terms, hinge(at).vertices);
    }
}

TEST_CASE("angles are lifted to the sheet nearest to the first shape's, and the sum has no kink there") {
  // 2 and -2: the second is lifted to 2 pi - 2 = 4.28, and their average lies at pi
  const auto flat = hinge(0);
  const std::vector<Weighted> terms{{hinge(2).vertices, 1}, {hinge(-2).vertices, 1}};
  const auto average = averageOf(*flat.topology, terms);
  const auto valueAt = [&](const Vertices& x) { return average.value(*flat.topology, measure(*flat.topology, x)); };
  const double folded = valueAt(hinge(kPi).vertices);
  CHECK(folded < valueAt(hinge(2.9).vertices));
  CHECK(folded < valueAt(hinge(-2.9).vertices));
  CHECK(valueAt(hinge(2.5).vertices) == Approx(valueAt(hinge(-2.5).vertices)).epsilon(1e-12));
  // away from the sheet's end at angle 0, the sum is smooth although each term's difference passes pi
  for (const double at : {1.0, 1.3, -1.0, 2.8, kPi}) {
    INFO("angle " << at);
    const Vertices x = hinge(at).vertices;
    const Vertices numeric = differenceGradient(valueAt, x, 1e-4);
    CHECK((averageGradient(*flat.topology, average, x, 1) - numeric).norm() < 1e-8 * (1 + numeric.norm()));
  }
}

TEST_CASE("a collapsed deformed shape costs the average infinitely much") {
  const auto sheet = grid(3);
  Vertices collapsed = sheet.vertices;
  collapsed.row(0) = collapsed.row(1);
  const auto average = averageOf(*sheet.topology, {{sheet.vertices, 1}});
  CHECK(std::isinf(average.value(*sheet.topology, measure(*sheet.topology, collapsed))));
}
