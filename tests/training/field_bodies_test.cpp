#include <sys/resource.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <cstdlib>
#include <iostream>

#include "core/io/mesh_file.h"
#include "core/io/npy.h"
#include "core/mesh/quality.h"
#include "core/sample/random.h"
#include "core/sample/surface_sampler.h"
#include "core/statistics/linear_pca.h"
#include "core/surface/laplacian.h"
#include "core/training/field_training.h"
#include "tests/support/real_data.h"

using namespace shaped;
using namespace shaped::test;

namespace {

double setting(const char* name, double otherwise) {
  const char* text = std::getenv(name);
  return text ? std::atof(text) : otherwise;
}

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

double megabytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

std::vector<Vertices> identities(const std::filesystem::path& path) {
  const auto array = readNpy(path);
  std::vector<Vertices> shapes;
  for (std::int64_t i = 0; i < array.shape[0]; ++i)
    shapes.emplace_back(Eigen::Map<const Vertices>(array.values.data() + i * 3 * array.shape[1], array.shape[1], 3));
  return shapes;
}

/// Points of a body with normals, and the noise of a scanner along each coordinate.
Scan scanOf(const Vertices& body, const Faces& faces, int points, double noise, std::uint64_t seed) {
  const SurfaceSampler sampler(body, faces);
  const Vertices normals = faceNormals(faces, body);
  Random random(seed);
  Scan scan{Vertices(points, 3), Vertices(points, 3), {}};
  for (int i = 0; i < points; ++i) {
    const auto sample = sampler(random);
    scan.normals.row(i) = normals.row(sample.face);
    scan.points.row(i) = at(sample, faces, body);
    for (int axis = 0; axis < 3; ++axis) scan.points(i, axis) += noise * random.normal();
  }
  return scan;
}

/// The body with 1,250 of its vertices.
struct CoarseBody {
  TopologyPtr topology;
  std::vector<std::int64_t> kept;

  Vertices operator()(const Vertices& shape) const { return shape(kept, Eigen::all); }
};

std::optional<CoarseBody> coarseBody() {
  const auto kept_file = realData("posed_body/coarse_1k/vertex_index_in_full_i32.npy");
  const auto mesh_file = realData("body_sequences/rest_1k_smallwoman.ply");
  if (!kept_file || !mesh_file) return std::nullopt;
  const auto kept = readNpy(*kept_file);
  const auto faces = readMesh(*mesh_file).faces;
  return CoarseBody{std::make_shared<const Topology>(static_cast<std::int32_t>(kept.values.size()), faces),
                    {kept.values.begin(), kept.values.end()}};
}

struct Body {
  Vertices source, target;
  Scan scan;
};

/// Mean vertex distance with the shape moved to where the target is centred, mm.
double centredDistance(const JacobianPoisson& poisson, const Vertices& shape, const Vertices& target) {
  const Vertices there = poisson.solve(poisson.jacobians(shape), poisson.centroids(target));
  return 1e3 * meanVertexDistance(there, target);
}

/// Mean distance over the surface, mm: vertices count by the reference's area, as in the loss.
double surfaceDistance(const Eigen::VectorXd& areas, const Vertices& shape, const Vertices& target) {
  return 1e3 * (shape - target).rowwise().norm().dot(areas) / areas.sum();
}

struct Errors {
  double source = 0, field = 0, centred_source = 0, centred_field = 0, surface_source = 0, surface_field = 0;
};

Errors errorsOf(const JacobianField& field, const FieldReference& reference, const std::vector<Body>& bodies) {
  Errors sum;
  const auto count = static_cast<double>(bodies.size());
  const auto areas = lumpedAreas(reference.shape, reference.poisson->topology().faces());
  for (const auto& [source, target, scan] : bodies) {
    const auto features = jacobianFieldFeatures(reference, source, scan, field.weights().scaling);
    const auto output = field.deform(*reference.poisson, features);
    sum.source += 1e3 * meanVertexDistance(source, target) / count;
    sum.field += 1e3 * meanVertexDistance(output, target) / count;
    sum.surface_source += surfaceDistance(areas, source, target) / count;
    sum.surface_field += surfaceDistance(areas, output, target) / count;
    sum.centred_source += centredDistance(*reference.poisson, source, target) / count;
    sum.centred_field += centredDistance(*reference.poisson, output, target) / count;
  }
  return sum;
}

void print(const char* what, const Errors& errors) {
  std::cout << what << ": X_o " << errors.source << " mm, field " << errors.field << " mm; centred X_o "
            << errors.centred_source << " mm, field " << errors.centred_field << " mm; by area X_o "
            << errors.surface_source << " mm, field " << errors.surface_field << " mm\n"
            << std::flush;
}

}  // namespace

// Minutes to hours: asked for by its name. FIELD_EPOCHS and the other settings below change it.
TEST_CASE("a field learns bodies that a linear model leaves something of, and says what that does for others",
          "[.][bodies]") {
  const auto shapes_file = realData("body_identities/rest_f32.npy");
  const auto mesh_file = realData("body_identities/template.ply");
  if (!shapes_file || !mesh_file) return;
  const auto shapes = identities(*shapes_file);
  const auto faces = readMesh(*mesh_file).faces;
  const auto full = std::make_shared<const Topology>(static_cast<std::int32_t>(shapes[0].rows()), faces);
  const auto coarse = setting("FIELD_COARSE", 0) != 0 ? coarseBody() : std::nullopt;
  const auto topology = coarse ? coarse->topology : full;
  const std::size_t in_pca = 30, in_training = static_cast<std::size_t>(setting("FIELD_PAIRS", 30)), held_out = 20;
  const auto pca = linearPca({shapes.begin(), shapes.begin() + in_pca});

  double start = seconds();
  const auto reference =
      std::make_shared<const FieldReference>(*makeFieldReference(topology, coarse ? (*coarse)(pca.mean) : pca.mean));
  std::cout << "reference: " << seconds() - start << " s\n";
  const auto scaling = scalingOf(*reference);
  const int points = static_cast<int>(setting("FIELD_POINTS", 20000));
  const auto bodyOf = [&](std::size_t i, bool at_training_resolution = true) {
    Body body{projectLinearly(pca, shapes[i], 11), shapes[i], scanOf(shapes[i], faces, points, 1.5e-3, i)};
    return coarse && at_training_resolution ? Body{(*coarse)(body.source), (*coarse)(body.target), body.scan} : body;
  };
  std::vector<FieldPair> pairs;
  std::vector<Body> seen, unseen;
  for (std::size_t i = in_pca; i < in_pca + in_training; ++i) {
    auto body = bodyOf(i);
    pairs.push_back(makeFieldPair(reference, body.source, body.target, body.scan, scaling));
    if (seen.size() < 10) seen.push_back(std::move(body));
  }
  for (std::size_t i = shapes.size() - held_out; i < shapes.size(); ++i) unseen.push_back(bodyOf(i));

  FieldTrainingOptions options;
  options.epochs = static_cast<int>(setting("FIELD_EPOCHS", 40));
  options.batch = static_cast<int>(setting("FIELD_BATCH", 2));
  options.learning_rate = setting("FIELD_RATE", 1e-3);
  options.last_learning_rate = setting("FIELD_LAST_RATE", 1e-4);
  options.vertex_weight = setting("FIELD_VERTEX_WEIGHT", 10);
  start = seconds();
  const double limit = setting("FIELD_SECONDS", 1e9);
  std::stop_source stop;
  options.stop = stop.get_token();
  options.each_epoch = [&](const FieldEpoch& epoch, const FieldTrainingState& state) {
    std::cout << epoch.epoch << " loss " << epoch.loss.total << " vertex " << epoch.loss.vertex << " jacobian "
              << epoch.loss.jacobian << " after " << seconds() - start << " s, " << megabytes() << " MB\n"
              << std::flush;
    if (epoch.epoch % 10 == 0) print("unseen", errorsOf(JacobianField(state.weights), *reference, unseen));
    if (seconds() - start > limit) stop.request_stop();
  };
  FieldArchitecture architecture;
  architecture.offsets = setting("FIELD_OFFSETS", 0) != 0;
  const auto trained = trainJacobianField(pairs, untrainedState(untrainedField(scaling, architecture, 1)), options);
  const JacobianField field(trained.solution.weights);
  const auto learned = errorsOf(field, *reference, seen);
  print("seen", learned);
  print("unseen", errorsOf(field, *reference, unseen));
  if (coarse) {
    std::vector<Body> fine;
    for (std::size_t i = shapes.size() - held_out; i < shapes.size(); ++i) fine.push_back(bodyOf(i, false));
    print("unseen, full resolution", errorsOf(field, *makeFieldReference(full, pca.mean), fine));
  }
  start = seconds();
  const auto features = jacobianFieldFeatures(*reference, unseen[0].source, unseen[0].scan, scaling);
  std::cout << "features: " << seconds() - start << " s, ";
  start = seconds();
  field.predict(features);
  std::cout << "networks: " << seconds() - start << " s, ";
  start = seconds();
  field.deform(*reference->poisson, features);
  std::cout << "with Poisson: " << seconds() - start << " s\n";
  CHECK(learned.surface_field < learned.surface_source);
}
