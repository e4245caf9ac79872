#include "core/neural/jacobian_field.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "core/mesh/quality.h"
#include "core/neural/jacobian_field_file.h"
#include "core/numerics/error.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::test;

namespace {

std::vector<Linear> randomLayers(const std::vector<Eigen::Index>& widths, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(-1, 1);
  std::vector<Linear> layers;
  for (std::size_t i = 0; i + 1 < widths.size(); ++i) {
    const float size = 2 / std::sqrt(float(widths[i]));
    layers.push_back({Eigen::MatrixXf::NullaryExpr(widths[i + 1], widths[i], [&] { return size * uniform(random); }),
                      Eigen::VectorXf::NullaryExpr(widths[i + 1], [&] { return uniform(random); })});
  }
  return layers;
}

JacobianFieldWeights randomWeights(const FieldScaling& scaling, bool offsets) {
  return {scaling, randomLayers({56, 20, 12}, 1), randomLayers({6, 16, 10}, 2),
          randomLayers({65 + 2 * (12 + 10) + (offsets ? 15 : 0), 24, 24, 24, 9}, 3), offsets};
}

/// A tube as the reference, a bent fatter one as the source, and a scan of something near.
struct Example {
  Mesh mesh = tube(14, 10);
  FieldReference reference = *makeFieldReference(mesh.topology, jitter(mesh.vertices, 0.02, 1));
  FieldScaling scaling = scalingOf(reference);
  Vertices source = jitter(bend(1.1 * mesh.vertices, 0.2), 0.01, 2);
  Scan scan{jitter(source, 0.05, 3), jitter(source, 0.5, 4), {}};

  JacobianFieldFeatures features() const { return jacobianFieldFeatures(reference, source, scan, scaling); }
};

std::vector<float> rowOf(const Eigen::MatrixXf& matrix, Eigen::Index row) {
  std::vector<float> numbers;
  for (Eigen::Index i = 0; i < matrix.cols(); ++i) numbers.push_back(matrix(row, i));
  return numbers;
}

/// One triangle's output from the list of its inputs, as the header has it; the networks are tested on their own.
Eigen::MatrixXf literalOutput(const JacobianFieldWeights& weights, const JacobianFieldFeatures& features,
                              Eigen::Index face) {
  const auto source = PointNet(weights.source_net)(features.triangles),
             scan = PointNet(weights.scan_net)(features.scan);
  std::vector<float> item = rowOf(features.triangles, face);
  const auto append = [&](const std::vector<float>& numbers) {
    item.insert(item.end(), numbers.begin(), numbers.end());
  };
  append(rowOf(features.current.cast<float>(), face));
  append(rowOf(source.each, face));
  append(rowOf(scan.each, features.nearest[static_cast<std::size_t>(face)]));
  if (weights.offsets) append(rowOf(features.offsets, face));
  append(rowOf(source.whole, 0));
  append(rowOf(scan.whole, 0));
  return Mlp(weights.mlp)(Eigen::Map<Eigen::RowVectorXf>(item.data(), std::ssize(item)));
}

void zeroLastLayer(JacobianFieldWeights& weights) {
  weights.mlp.back().weight.setZero();
  weights.mlp.back().bias.setZero();
}

}  // namespace

TEST_CASE("a field's features are what each triangle and point is, scaled") {
  const Example example;
  const auto features = example.features();
  const auto& faces = example.mesh.topology->faces();
  const auto normals = faceNormals(faces, example.source);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const Eigen::RowVector3d centroid = example.source(faces.row(f), Eigen::all).colwise().mean();
    const Eigen::RowVector3d scaled = (centroid - example.scaling.centre) / example.scaling.extent;
    CHECK((features.triangles.row(f).head<3>().cast<double>() - scaled).norm() < 1e-6);
    CHECK((features.triangles.row(f).segment<3>(3).cast<double>() - normals.row(f)).norm() < 1e-6);
    Eigen::Index nearest;
    (example.scan.points.rowwise() - centroid).rowwise().norm().minCoeff(&nearest);
    CHECK(features.nearest[static_cast<std::size_t>(f)] == nearest);
    const Eigen::RowVector3d offset = (example.scan.points.row(nearest) - centroid) / (0.01 * example.scaling.extent);
    CHECK((features.offsets.row(f).head<3>().cast<double>() - offset * std::min(1.0, 10 / offset.norm())).norm() <
          1e-5);
    const Eigen::RowVector3d turned = example.scan.normals.row(nearest).normalized() - normals.row(f);
    CHECK((features.offsets.row(f).segment<3>(3).cast<double>() - turned).norm() < 1e-6);
  }
  CHECK(features.offsets.leftCols<3>().rowwise().norm().maxCoeff() < 10.0001F);
  CHECK(features.current.isApprox(example.reference.poisson->jacobians(example.source)));
  for (Eigen::Index p = 0; p < example.scan.points.rows(); ++p)
    CHECK(features.scan.row(p).tail<3>().norm() == Approx(1));
}

TEST_CASE("the last offsets are the Jacobians of a source that is pulled to a dense scan along its normals") {
  Example example;
  const auto& faces = example.mesh.topology->faces();
  const Vertices normals = vertexNormals(faces, example.source);
  const auto pulledBy = [&](double distance) -> Eigen::MatrixXf {
    // Eight points about where each vertex is to go, so that their mean is there.
    example.scan = {Vertices(8 * example.source.rows(), 3), {}, {}};
    for (Eigen::Index v = 0; v < example.source.rows(); ++v)
      for (int i = 0; i < 8; ++i) {
        const Eigen::RowVector3d about(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
        example.scan.points.row(8 * v + i) = example.source.row(v) + distance * normals.row(v) + 1e-4 * about;
      }
    return example.features().offsets.rightCols<9>();
  };
  const auto expected = [&](double distance) -> Eigen::MatrixXf {
    return example.reference.poisson->jacobians(distance * normals).cast<float>();
  };
  const double cut = 0.05 * example.scaling.extent;
  CHECK(pulledBy(0.5 * cut).isApprox(expected(0.5 * cut), 1e-3F));
  CHECK(pulledBy(-0.5 * cut).isApprox(expected(-0.5 * cut), 1e-3F));
  CHECK(pulledBy(1.2 * cut).isApprox(expected(cut), 1e-3F));
}

TEST_CASE("the reference's own signatures have mean 0 and deviation 1 over its surface, and fit in the unit box") {
  const Example example;
  const auto features =
      jacobianFieldFeatures(example.reference, example.reference.shape, {example.source, {}, {}}, example.scaling);
  const Eigen::RowVectorXf shares =
      (example.reference.poisson->areas() / example.reference.poisson->areas().sum()).transpose().cast<float>();
  const Eigen::MatrixXf signatures = features.triangles.rightCols<50>();
  CHECK((shares * signatures).cwiseAbs().maxCoeff() < 1e-4F);
  CHECK(((shares * signatures.cwiseAbs2()).array() - 1).abs().maxCoeff() < 1e-3F);
  CHECK(features.triangles.leftCols<3>().cwiseAbs().maxCoeff() < 1);
  CHECK(features.scan.rightCols<3>().isZero(0));
  CHECK(features.offsets.middleCols<3>(3).isZero(0));
}

TEST_CASE("a field adds a perceptron's answer to each triangle's current Jacobian") {
  const Example example;
  const auto features = example.features();
  for (const bool offsets : {false, true}) {
    const auto weights = randomWeights(example.scaling, offsets);
    const Jacobians jacobians = JacobianField(weights).predict(features);
    for (Eigen::Index f = 0; f < jacobians.rows(); f += 7) {
      const Eigen::RowVectorXf added = (jacobians - features.current).row(f).cast<float>();
      CHECK((added - literalOutput(weights, features, f)).norm() < 1e-4F * (1 + added.norm()));
    }
  }
}

TEST_CASE("a field with a last layer of zeros leaves every shape as it is") {
  const Example example;
  auto weights = randomWeights(example.scaling, false);
  const auto features = example.features();
  CHECK((JacobianField(weights).deform(*example.reference.poisson, features) - example.source).norm() > 0.1);
  zeroLastLayer(weights);
  const auto same = JacobianField(weights).deform(*example.reference.poisson, features);
  CHECK((same - example.source).cwiseAbs().maxCoeff() < 1e-10);
}

TEST_CASE("a field does not mind the order of a scan's points, or of the triangles, but minds what the scan is") {
  const Example example;
  const JacobianField field(randomWeights(example.scaling, true));
  const auto jacobians = field.predict(example.features());
  std::vector<int> order(static_cast<std::size_t>(example.scan.points.rows()));
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), std::mt19937(1));
  auto other = example;
  other.scan = {example.scan.points(order, Eigen::all), example.scan.normals(order, Eigen::all), {}};
  CHECK(field.predict(other.features()).isApprox(jacobians, 1e-5));
  const Faces reversed = example.mesh.topology->faces().colwise().reverse();
  const auto topology = std::make_shared<const Topology>(example.mesh.topology->vertexCount(), reversed);
  other.reference = *makeFieldReference(topology, example.reference.shape);
  CHECK(Jacobians(field.predict(other.features()).colwise().reverse()).isApprox(jacobians, 1e-4));
  other.scan.points.array() += 0.1;
  CHECK_FALSE(Jacobians(field.predict(other.features()).colwise().reverse()).isApprox(jacobians, 1e-3));
}

TEST_CASE("one field serves meshes of other topologies") {
  const Example example;
  const JacobianField field(randomWeights(example.scaling, false));
  const auto sphere = icosphere(2);
  const auto reference = *makeFieldReference(sphere.topology, sphere.vertices);
  const Vertices source = jitter(sphere.vertices, 0.02, 1);
  const auto features = jacobianFieldFeatures(reference, source, example.scan, example.scaling);
  const auto shape = field.deform(*reference.poisson, features);
  REQUIRE(shape.rows() == sphere.vertices.rows());
  CHECK(shape.allFinite());
  CHECK((reference.poisson->centroids(shape) - reference.poisson->centroids(source)).norm() < 1e-10);
}

TEST_CASE("a field comes back from its file to the bit") {
  const TemporaryFolder folder;
  const Example example;
  const auto weights = randomWeights(example.scaling, true);
  TensorWriter writer;
  addJacobianField("field", weights, writer);
  writer.write(folder / "field.safetensors");
  const TensorFile file(folder / "field.safetensors");
  const auto back = readJacobianField(file, "field");
  CHECK(back.offsets);
  CHECK(JacobianField(back).predict(example.features()) == JacobianField(weights).predict(example.features()));
  CHECK(back.scaling.centre == weights.scaling.centre);
  CHECK(back.scaling.extent == weights.scaling.extent);
  CHECK_THROWS_WITH(readJacobianField(file, "other"), Catch::Contains("other.scaling.centre"));
}

TEST_CASE("fields refuse networks that do not fit together") {
  const Example example;
  auto weights = randomWeights(example.scaling, false);
  weights.offsets = true;
  CHECK_THROWS_WITH(JacobianField(weights), Catch::Contains("mlp: takes 109 features to 9 numbers, want 124 to 9"));
  weights = randomWeights(example.scaling, false);
  weights.scan_net = randomLayers({3, 16, 10}, 2);
  CHECK_THROWS_WITH(JacobianField(weights), Catch::Contains("scan_net: takes 3 features, want 6"));
  weights = randomWeights(example.scaling, false);
  weights.source_net.clear();
  CHECK_THROWS_WITH(JacobianField(weights), Catch::Contains("source_net.layers: there is none"));
  weights = randomWeights(example.scaling, false);
  weights.scaling.signature_deviation[3] = 0;
  CHECK_THROWS_WITH(JacobianField(weights), Catch::Contains("scaling.signature_deviation"));
}

TEST_CASE("features refuse sources, scans and scalings that do not fit") {
  const Example good;
  auto example = good;
  example.source = Vertices::Zero(3, 3);
  CHECK_THROWS_WITH(example.features(), Catch::Contains("source: has 3 vertices, want 142"));
  example = good;
  example.scan.points.resize(0, 3);
  CHECK_THROWS_WITH(example.features(), Catch::Contains("scan.points: are none"));
  example = good;
  example.scan.normals.conservativeResize(5, 3);
  CHECK_THROWS_WITH(example.features(), Catch::Contains("scan.normals: are 5, want none or 142"));
  example = good;
  example.scan.points(1, 1) = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(example.features(), Catch::Contains("scan.points: hold a coordinate that is not a finite number"));
  example = good;
  example.scaling.extent = 0;
  CHECK_THROWS_WITH(example.features(), Catch::Contains("scaling.extent"));
  auto features = good.features();
  features.nearest.back() = 1000;
  CHECK_THROWS_WITH(JacobianField(randomWeights(good.scaling, false)).predict(features),
                    Catch::Contains("features: name scan point 1000 of 142"));
  std::stop_source stopped;
  stopped.request_stop();
  CHECK_FALSE(makeFieldReference(good.mesh.topology, good.mesh.vertices, stopped.get_token()));
}
