#include "core/surface/spectrum.h"

#include <catch2/catch.hpp>
#include <numbers>

#include "core/numerics/error.h"
#include "core/surface/laplacian.h"
#include "tests/support/calculus.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;

namespace {

SurfaceSpectrum spectrumOf(const Topology& topology, const Vertices& shape, int count) {
  SpectrumOptions options;
  options.count = count;
  const auto solved = surfaceSpectrum(topology, shape, options);
  REQUIRE(solved.converged());
  CHECK(solved.residual <= options.tolerance);
  REQUIRE(solved.solution.eigenvalues.size() == count);
  return solved.solution;
}

/// What defines eigenpairs, whatever the solver: ascending, orthonormal, and every pair solves the equation.
void checkLaws(const Topology& topology, const Vertices& shape, const SurfaceSpectrum& spectrum) {
  const auto& [values, functions, areas] = spectrum;
  const auto count = values.size();
  CHECK(areas == lumpedAreas(shape, topology.faces()));
  CHECK(std::is_sorted(values.begin(), values.end()));
  CHECK(values[0] == 0);
  const Eigen::MatrixXd gram = functions.transpose() * areas.asDiagonal() * functions;
  CHECK((gram - Eigen::MatrixXd::Identity(count, count)).cwiseAbs().maxCoeff() < 1e-9);
  const Eigen::MatrixXd forces = cotangentStiffness(shape, topology.faces()) * functions;
  const Eigen::MatrixXd expected = areas.asDiagonal() * functions * values.asDiagonal();
  CHECK((forces - expected).norm() < 1e-8 * forces.norm());
}

/// Two copies of a mesh, the second one moved away.
Mesh pairOf(const Mesh& mesh) {
  const auto count = mesh.vertices.rows(), faces = mesh.topology->faces().rows();
  Vertices vertices(2 * count, 3);
  vertices << mesh.vertices, mesh.vertices.rowwise() + Eigen::RowVector3d(5, 0, 0);
  Faces both(2 * faces, 3);
  both << mesh.topology->faces(), mesh.topology->faces().array() + static_cast<int>(count);
  return {std::make_shared<Topology>(static_cast<std::int32_t>(2 * count), both), vertices};
}

/// l (l + 1), each 2 l + 1 times.
Eigen::VectorXd sphereEigenvalues(int highest) {
  std::vector<double> values;
  for (int l = 0; l <= highest; ++l) values.insert(values.end(), 2 * l + 1, l * (l + 1));
  return Eigen::Map<Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

double worstRelativeError(const Eigen::VectorXd& values, const Eigen::VectorXd& exact) {
  return (values - exact).tail(exact.size() - 1).cwiseQuotient(exact.tail(exact.size() - 1)).cwiseAbs().maxCoeff();
}

}  // namespace

TEST_CASE("a sphere's eigenvalues are l (l + 1), each as often as it should come, to second order") {
  const auto exact = sphereEigenvalues(5);
  const auto coarse = icosphere(3), fine = icosphere(4);
  const auto count = static_cast<int>(exact.size());
  const auto spectrum = spectrumOf(*fine.topology, fine.vertices, count);
  checkLaws(*fine.topology, fine.vertices, spectrum);
  const double fine_error = worstRelativeError(spectrum.eigenvalues, exact);
  const double coarse_error =
      worstRelativeError(spectrumOf(*coarse.topology, coarse.vertices, count).eigenvalues, exact);
  CHECK(fine_error < 0.02);
  CHECK(order(coarse_error, fine_error) == Approx(2).margin(0.3));
}

TEST_CASE("a sheet's eigenvalues are those of a free square membrane") {
  const auto mesh = grid(41);
  const auto spectrum = spectrumOf(*mesh.topology, mesh.vertices, 9);
  checkLaws(*mesh.topology, mesh.vertices, spectrum);
  Eigen::VectorXd exact(9);
  exact << 0, 1, 1, 2, 4, 4, 5, 5, 8;
  exact *= std::numbers::pi * std::numbers::pi;
  CHECK(worstRelativeError(spectrum.eigenvalues, exact) < 0.01);
}

TEST_CASE("the Lanczos search finds what dense eigenvalues find") {
  const auto mesh = icosphere(3);
  const Vertices shape = jitter(mesh.vertices, 0.02, 1);
  const auto all = spectrumOf(*mesh.topology, shape, 642), some = spectrumOf(*mesh.topology, shape, 40);
  checkLaws(*mesh.topology, shape, all);
  checkLaws(*mesh.topology, shape, some);
  CHECK(some.eigenvalues.isApprox(all.eigenvalues.head(40), 1e-10));
  CHECK((some.eigenfunctions - all.eigenfunctions.leftCols(40)).cwiseAbs().maxCoeff() < 1e-6);
}

TEST_CASE("several components have as many zeros, and each its own spectrum") {
  for (const int levels : {1, 3}) {  // dense, Lanczos
    const auto one = icosphere(levels), two = pairOf(one);
    const auto alone = spectrumOf(*one.topology, one.vertices, 16), both = spectrumOf(*two.topology, two.vertices, 32);
    checkLaws(*two.topology, two.vertices, both);
    CHECK(both.eigenvalues[1] == 0);
    for (int k = 0; k < 32; ++k) CHECK(both.eigenvalues[k] == Approx(alone.eigenvalues[k / 2]).epsilon(1e-9));
    const auto half = one.vertices.rows();
    CHECK(both.eigenfunctions.col(0).tail(half).isZero(0));
    CHECK(both.eigenfunctions.col(1).head(half).isZero(0));
  }
}

TEST_CASE("on a surface of many equal functions none is left out") {
  const auto mesh = icosphere(3), two = pairOf(mesh);
  const auto four = pairOf(two);
  const auto alone = spectrumOf(*mesh.topology, mesh.vertices, 25);
  const auto all = spectrumOf(*four.topology, four.vertices, 100);
  checkLaws(*four.topology, four.vertices, all);
  for (int k = 0; k < 100; ++k) CHECK(all.eigenvalues[k] == Approx(alone.eigenvalues[k / 4]).epsilon(1e-9));
}

TEST_CASE("no more than the constants may be asked for") {
  const auto mesh = pairOf(icosphere(3));
  CHECK(spectrumOf(*mesh.topology, mesh.vertices, 1).eigenvalues == Eigen::VectorXd::Zero(1));
  CHECK(spectrumOf(*mesh.topology, mesh.vertices, 2).eigenvalues == Eigen::VectorXd::Zero(2));
}

TEST_CASE("a spectrum does not mind rigid motion, and scales with the inverse square of the size") {
  const auto mesh = tube(30, 20);
  const Vertices shape = jitter(mesh.vertices, 0.02, 1);
  const auto spectrum = spectrumOf(*mesh.topology, shape, 20);
  const auto moved = spectrumOf(*mesh.topology, moveRigidly(shape, 4), 20);
  CHECK(moved.eigenvalues.isApprox(spectrum.eigenvalues, 1e-9));
  CHECK((moved.eigenfunctions - spectrum.eigenfunctions).cwiseAbs().maxCoeff() < 1e-5);
  const auto larger = spectrumOf(*mesh.topology, 10 * shape, 20);
  CHECK(larger.eigenvalues.isApprox(0.01 * spectrum.eigenvalues, 1e-9));
  CHECK((10 * larger.eigenfunctions - spectrum.eigenfunctions).cwiseAbs().maxCoeff() < 1e-5);
  const auto stretched = spectrumOf(*mesh.topology, shape * Eigen::Vector3d(1.2, 1, 1).asDiagonal(), 20);
  CHECK_FALSE(stretched.eigenvalues.isApprox(spectrum.eigenvalues, 0.05));
}

TEST_CASE("the same surface gives the same numbers, and the signs follow their rule") {
  const auto mesh = icosphere(3);
  const auto one = spectrumOf(*mesh.topology, mesh.vertices, 25), two = spectrumOf(*mesh.topology, mesh.vertices, 25);
  CHECK(one.eigenvalues == two.eigenvalues);
  CHECK(one.eigenfunctions == two.eigenfunctions);
  for (const auto& function : one.eigenfunctions.colwise()) {
    Eigen::Index v = 0;
    while (std::abs(function[v]) <= function.cwiseAbs().maxCoeff() / 2) ++v;
    CHECK(function[v] > 0);
  }
}

TEST_CASE("a spectrum that is not finished says so") {
  const auto mesh = icosphere(3);
  std::stop_source stop;
  stop.request_stop();
  const auto stopped = surfaceSpectrum(*mesh.topology, mesh.vertices, {}, stop.get_token());
  CHECK(stopped.termination == Termination::kCancelled);
  CHECK(stopped.solution.eigenvalues == Eigen::VectorXd::Zero(1));
  SpectrumOptions options;
  options.max_restarts = 1;
  const auto limited = surfaceSpectrum(*mesh.topology, jitter(mesh.vertices, 0.02, 1), options);
  CHECK(limited.termination == Termination::kIterationLimit);
  CHECK(limited.solution.eigenvalues.size() < 100);
  options = {};
  options.tolerance = 1e-30;
  CHECK(surfaceSpectrum(*mesh.topology, mesh.vertices, options).termination == Termination::kStalled);
}

TEST_CASE("a spectrum refuses bad options and shapes by name") {
  const auto mesh = icosphere(1);
  SpectrumOptions options;
  options.count = 43;
  CHECK_THROWS_WITH(surfaceSpectrum(*mesh.topology, mesh.vertices, options),
                    Catch::Contains("options: count = 43, want 1 to 42"));
  CHECK_THROWS_WITH(surfaceSpectrum(*mesh.topology, Vertices::Zero(42, 3), {}), Catch::Contains("shape: face 0"));
  options.count = 3;
  options.tolerance = 0;
  CHECK_THROWS_WITH(surfaceSpectrum(*mesh.topology, mesh.vertices, options), Catch::Contains("want > 0"));
}
