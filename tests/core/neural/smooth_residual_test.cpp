#include "core/neural/smooth_residual.h"

#include <Eigen/Cholesky>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/sample/random.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;
using Catch::Matchers::Contains;

namespace {

/// A sphere of radius 1 with its spectrum.
struct Sphere {
  Mesh mesh = icosphere(2);
  SurfaceSpectrum spectrum = surfaceSpectrum(*mesh.topology, mesh.vertices, {.count = 60}).solution;
  Vertices normals = vertexNormals(mesh.topology->faces(), mesh.vertices);

  /// A smooth displacement that moves the surface off and along itself.
  Vertices bulge(double size, double phase) const {
    Vertices moved(mesh.vertices.rows(), 3);
    for (Eigen::Index v = 0; v < moved.rows(); ++v) {
      const auto& x = mesh.vertices.row(v);
      moved.row(v) = size * Eigen::RowVector3d(std::sin(2 * x[1] + phase), x[0] * x[2], 0.5 * std::cos(x[0] - phase));
    }
    return moved;
  }
  Eigen::VectorXd offsetsOf(const Vertices& displacements) const {
    return (displacements.array() * normals.array()).rowwise().sum();
  }
};

double rms(const Eigen::MatrixXd& values) { return std::sqrt(values.squaredNorm() / double(values.rows())); }

constexpr double kUnseen = std::numeric_limits<double>::quiet_NaN();

}  // namespace

TEST_CASE("a smooth residual is the posterior mean that the kernel form of the process gives") {
  const Sphere sphere;
  const SmoothPrior prior{0.4, 1e-3};
  Eigen::VectorXd offsets = sphere.offsetsOf(sphere.bulge(0.01, 1));
  for (Eigen::Index v = 0; v < offsets.size(); v += 3) offsets[v] = kUnseen;

  // Covariance of displacements of two vertices, the same along each axis and none between axes.
  const auto& [values, functions, areas] = sphere.spectrum;
  Eigen::VectorXd powers = (1 + prior.reach * prior.reach * values.array()).pow(-1.5);
  powers *= areas.sum() / powers.sum();
  const Eigen::MatrixXd kernel = functions * powers.asDiagonal() * functions.transpose();
  std::vector<Eigen::Index> seen;
  for (Eigen::Index v = 0; v < offsets.size(); ++v)
    if (!std::isnan(offsets[v])) seen.push_back(v);
  const auto count = std::ssize(seen);
  Eigen::MatrixXd observed(count, count);
  Eigen::VectorXd right(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto v = seen[std::size_t(i)];
    right[i] = offsets[v];
    for (Eigen::Index j = 0; j < count; ++j) {
      const auto w = seen[std::size_t(j)];
      observed(i, j) = sphere.normals.row(v).dot(sphere.normals.row(w)) * kernel(v, w);
    }
    observed(i, i) += prior.noise * areas.sum() / areas[v];
  }
  const Eigen::VectorXd weights = observed.llt().solve(right);
  Vertices expected = Vertices::Zero(offsets.size(), 3);
  for (Eigen::Index v = 0; v < offsets.size(); ++v)
    for (Eigen::Index i = 0; i < count; ++i)
      expected.row(v) += kernel(v, seen[std::size_t(i)]) * weights[i] * sphere.normals.row(seen[std::size_t(i)]);

  const Vertices found = smoothResidual(sphere.spectrum, prior, sphere.normals, offsets);
  CHECK(rms(expected) > 1e-3);
  CHECK(maxVertexDistance(found, expected) < 1e-9);
}

TEST_CASE("one exact offset moves its own vertex by itself, and the others the further the longer the reach is") {
  const Sphere sphere;
  double last = 0;
  for (const double reach : {0.05, 0.2, 0.8}) {
    Eigen::VectorXd offsets = Eigen::VectorXd::Constant(sphere.normals.rows(), kUnseen);
    offsets[20] = 0.01;
    const Vertices moved = smoothResidual(sphere.spectrum, {reach, 1e-7}, sphere.normals, offsets);
    CHECK(moved.row(20).dot(sphere.normals.row(20)) == Approx(0.01).epsilon(0.01));
    const double elsewhere = rms(moved);
    CHECK(elsewhere > last);
    last = elsewhere;
  }
}

TEST_CASE("offsets of a smooth displacement bring back most of it, seen whole or in part; unseen it is nothing") {
  const Sphere sphere;
  const Vertices truth = sphere.bulge(0.01, 0.5);
  Eigen::VectorXd offsets = sphere.offsetsOf(truth);
  const SmoothPrior prior{0.8, 1e-4};
  const Vertices found = smoothResidual(sphere.spectrum, prior, sphere.normals, offsets);
  CHECK(rms(sphere.offsetsOf(found - truth)) < 0.05 * rms(sphere.offsetsOf(truth)));
  CHECK(rms(found - truth) < 0.7 * rms(truth));

  for (Eigen::Index v = 0; v < offsets.size(); ++v)
    if (sphere.mesh.vertices(v, 0) > 0.6) offsets[v] = kUnseen;
  const Vertices in_part = smoothResidual(sphere.spectrum, prior, sphere.normals, offsets);
  CHECK(rms(in_part - truth) < 0.8 * rms(truth));

  offsets.setConstant(kUnseen);
  CHECK(smoothResidual(sphere.spectrum, prior, sphere.normals, offsets).isZero(0));
}

TEST_CASE("the prior that fits is found: a long reach for smooth bodies, more noise for noisy offsets") {
  const Sphere sphere;
  const auto examplesOf = [&](double noise) {
    Random random(5);
    std::vector<SmoothExample> examples;
    for (int i = 0; i < 6; ++i) {
      const Vertices truth = sphere.bulge(0.01, i);
      Eigen::VectorXd offsets = sphere.offsetsOf(truth);
      for (auto& offset : offsets) offset += noise * random.normal();
      examples.push_back({sphere.normals, offsets, truth});
    }
    return examples;
  };
  const auto clean = fitSmoothness(sphere.spectrum, 3.4, examplesOf(0)),
             noisy = fitSmoothness(sphere.spectrum, 3.4, examplesOf(0.005));
  REQUIRE(clean.prior);
  REQUIRE(noisy.prior);
  CHECK(clean.after < noisy.after);
  CHECK(noisy.after < 0.9 * noisy.before);
  CHECK(clean.prior->noise < noisy.prior->noise);
  // It is what applying it leaves.
  double left = 0;
  for (const auto& example : examplesOf(0.005))
    left += (example.residual - smoothResidual(sphere.spectrum, *noisy.prior, example.normals, example.offsets))
                .squaredNorm();
  CHECK(noisy.after == Approx(std::sqrt(left / (6 * double(sphere.normals.rows())))));
}

TEST_CASE("offsets that say nothing of the residual leave it alone") {
  const Sphere sphere;
  Random random(6);
  std::vector<SmoothExample> examples;
  for (int i = 0; i < 4; ++i) {
    Eigen::VectorXd offsets(sphere.normals.rows());
    for (auto& offset : offsets) offset = 0.01 * random.normal();
    // What is there is the opposite of what is seen.
    const Vertices moved = smoothResidual(sphere.spectrum, {0.3, 1e-3}, sphere.normals, offsets);
    examples.push_back({sphere.normals, offsets, -moved});
  }
  const auto fitted = fitSmoothness(sphere.spectrum, 3.4, examples);
  CHECK_FALSE(fitted.prior);
  CHECK(fitted.after == fitted.before);
  CHECK_FALSE(fitSmoothness(sphere.spectrum, 3.4, {}).prior);
}

TEST_CASE("a smooth residual refuses what does not fit, by name") {
  const Sphere sphere;
  const Eigen::VectorXd offsets = Eigen::VectorXd::Zero(sphere.normals.rows());
  CHECK_THROWS_WITH(smoothResidual(sphere.spectrum, {0, 1}, sphere.normals, offsets), Contains("prior: reach"));
  CHECK_THROWS_WITH(smoothResidual(sphere.spectrum, {1, 0}, sphere.normals, offsets), Contains("prior: noise"));
  CHECK_THROWS_WITH(smoothResidual(sphere.spectrum, {1, 1}, sphere.normals, offsets.head(3)), Contains("offsets"));
  CHECK_THROWS_WITH(fitSmoothness(sphere.spectrum, 1, {{sphere.normals, offsets, Vertices::Zero(2, 3)}}),
                    Contains("examples[0]"));
}
