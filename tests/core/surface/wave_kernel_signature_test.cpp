#include "core/surface/wave_kernel_signature.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/numerics/error.h"
#include "tests/support/calculus.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;

namespace {

SurfaceSpectrum spectrumOf(const Mesh& mesh, const Vertices& shape, int count) {
  SpectrumOptions options;
  options.count = count;
  return surfaceSpectrum(*mesh.topology, shape, options).solution;
}

/// The formula, sum by sum.
double literal(const SurfaceSpectrum& spectrum, Eigen::Index vertex, int level, int energies, double width,
               int components) {
  const auto last = spectrum.eigenvalues.size() - 1;
  const double low = std::log(spectrum.eigenvalues[components]), high = std::log(spectrum.eigenvalues[last]);
  const double sigma = width * (high - low) / (energies - 1);
  const double energy = low + (high - low) * level / (energies - 1);
  double above = 0, below = 0, area = 0;
  for (Eigen::Index k = components; k <= last; ++k) {
    const double offset = energy - std::log(spectrum.eigenvalues[k]);
    const double weight = std::exp(-offset * offset / (2 * sigma * sigma));
    above += weight * spectrum.eigenfunctions(vertex, k) * spectrum.eigenfunctions(vertex, k);
    below += weight;
  }
  for (const double a : spectrum.areas) area += a;
  return area * above / below;
}

double spread(const Eigen::MatrixXd& rows) {
  return (rows.colwise().maxCoeff() - rows.colwise().minCoeff()).maxCoeff();
}

}  // namespace

TEST_CASE("the wave kernel signature is its formula, and its mean over the surface is 1") {
  const auto mesh = tube(20, 12);
  const auto spectrum = spectrumOf(mesh, jitter(mesh.vertices, 0.02, 1), 30);
  for (const auto& options : {WaveKernelOptions{}, WaveKernelOptions{12, 1.5}}) {
    const auto signature = waveKernelSignature(spectrum, options);
    REQUIRE(signature.cols() == options.energies);
    REQUIRE(signature.rows() == mesh.vertices.rows());
    for (Eigen::Index v = 0; v < signature.rows(); v += 17)
      for (int n = 0; n < options.energies; ++n)
        CHECK(signature(v, n) == Approx(literal(spectrum, v, n, options.energies, options.width, 1)).epsilon(1e-12));
    const Eigen::VectorXd means = signature.transpose() * spectrum.areas / spectrum.areas.sum();
    CHECK((means.array() - 1).abs().maxCoeff() < 1e-10);
  }
}

TEST_CASE("a signature minds neither rigid motion nor size, but it does mind shape") {
  const auto mesh = tube(30, 20);
  const Vertices shape = jitter(mesh.vertices, 0.01, 1);
  const auto signature = waveKernelSignature(spectrumOf(mesh, shape, 40));
  const auto same = waveKernelSignature(spectrumOf(mesh, 7 * moveRigidly(shape, 2), 40));
  CHECK((same - signature).cwiseAbs().maxCoeff() < 1e-7);
  const Vertices thick = shape * Eigen::Vector3d(1, 1, 1.5).asDiagonal();
  CHECK((waveKernelSignature(spectrumOf(mesh, thick, 40)) - signature).cwiseAbs().maxCoeff() > 0.1);
}

TEST_CASE("a signature does not see how a sheet is rolled") {
  const auto sheet = grid(25);
  const auto signature = waveKernelSignature(spectrumOf(sheet, sheet.vertices, 30));
  const auto rolled = waveKernelSignature(spectrumOf(sheet, curl(sheet.vertices, 2), 30));
  const Vertices longer = sheet.vertices * Eigen::Vector3d(1.2, 1, 1).asDiagonal();
  const auto stretched = waveKernelSignature(spectrumOf(sheet, longer, 30));
  CHECK((rolled - signature).norm() < 0.02 * (stretched - signature).norm());
}

TEST_CASE("vertices that a symmetry maps onto each other share their signature") {
  const auto mesh = icosphere(3);
  const auto spectrum = spectrumOf(mesh, mesh.vertices, 16);  // whole eigenspaces
  const auto signature = waveKernelSignature(spectrum);
  CHECK(spread(signature.topRows(12)) < 1e-8);  // the icosahedron's own corners
  CHECK(spread(signature) > 1e-4);
  const auto jittered = waveKernelSignature(spectrumOf(mesh, jitter(mesh.vertices, 0.02, 1), 16));
  CHECK(spread(jittered.topRows(12)) > 1e-3);
}

TEST_CASE("a signature tells a tube's ends from its middle, and leaves out the constants of components") {
  const auto mesh = tube(40, 20);
  const auto signature = waveKernelSignature(spectrumOf(mesh, mesh.vertices, 60));
  const Eigen::RowVectorXd end = signature.row(0), middle = signature.row(20 * 20), far_end = signature.row(39 * 20);
  CHECK((end - middle).norm() > 100 * (end - far_end).norm());
  const auto half = icosphere(2);
  Vertices vertices(2 * half.vertices.rows(), 3);
  vertices << half.vertices, (3 * half.vertices).rowwise() + Eigen::RowVector3d(9, 0, 0);
  Faces faces(2 * half.topology->faces().rows(), 3);
  faces << half.topology->faces(), half.topology->faces().array() + half.topology->vertexCount();
  const Mesh two{std::make_shared<Topology>(static_cast<std::int32_t>(vertices.rows()), faces), vertices};
  const auto spectrum = spectrumOf(two, vertices, 20);
  const auto both = waveKernelSignature(spectrum);
  for (int n = 0; n < 50; n += 7) CHECK(both(5, n) == Approx(literal(spectrum, 5, n, 50, 7, 2)).epsilon(1e-12));
}

TEST_CASE("a window far narrower than the gaps still sees its nearest eigenvalue") {
  const auto mesh = icosphere(1);
  const auto signature = waveKernelSignature(spectrumOf(mesh, mesh.vertices, 9), {50, 1e-4});
  CHECK(signature.allFinite());
  CHECK(signature.col(25).maxCoeff() > 0);
}

TEST_CASE("a signature refuses a spectrum without two energies, and bad options") {
  const auto mesh = icosphere(1);
  CHECK_THROWS_WITH(waveKernelSignature(spectrumOf(mesh, mesh.vertices, 2)),
                    Catch::Contains("spectrum: has 1 positive eigenvalues, want two that differ"));
  CHECK_THROWS_WITH(waveKernelSignature(spectrumOf(mesh, mesh.vertices, 1)), Catch::Contains("has 0 positive"));
  CHECK_THROWS_WITH(waveKernelSignature(spectrumOf(mesh, mesh.vertices, 4)), Catch::Contains("two that differ"));
  const auto spectrum = spectrumOf(mesh, mesh.vertices, 9);
  CHECK_THROWS_WITH(waveKernelSignature(spectrum, {1, 7}), Catch::Contains("options: energies = 1, want >= 2"));
  CHECK_THROWS_WITH(waveKernelSignature(spectrum, {50, 0}), Catch::Contains("options: width"));
}
