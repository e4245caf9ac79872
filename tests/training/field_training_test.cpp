#include "core/training/field_training.h"

#include <tbb/global_control.h>

#include <catch2/catch.hpp>
#include <thread>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/training/field_checkpoint.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::test;

namespace {

/// Sources that are to be bent and thinned, as their scans show: on a tube and on a sphere.
struct Lesson {
  std::shared_ptr<const FieldReference> reference;
  Vertices source, target;
  Scan scan;
};

Lesson lesson(const Mesh& mesh, double angle, unsigned seed) {
  Lesson made{std::make_shared<const FieldReference>(*makeFieldReference(mesh.topology, mesh.vertices)),
              jitter(bend(mesh.vertices, 0.1 * seed), 0.01, seed),
              {},
              {}};
  made.target = bend(made.source, angle);
  made.target.col(2) *= 0.8;
  made.scan = {jitter(made.target, 0.002, seed), vertexNormals(mesh.topology->faces(), made.target), {}};
  return made;
}

struct Course {
  std::vector<Lesson> lessons = {lesson(tube(10, 8), 0.5, 1), lesson(icosphere(2), -0.4, 2),
                                 lesson(tube(9, 9), 0.2, 3)};
  FieldScaling scaling = scalingOf(*lessons[0].reference);
  std::vector<FieldPair> pairs;

  explicit Course(std::size_t count = 3) {
    for (std::size_t i = 0; i < count; ++i) {
      const auto& [reference, source, target, scan] = lessons[i];
      pairs.push_back(makeFieldPair(reference, source, target, scan, scaling));
    }
  }

  FieldTrainingState start(std::uint64_t seed = 1, const std::vector<int>& mlp = {32, 32, 32}) const {
    return untrainedState(untrainedField(scaling, {{16, 16}, {16, 16}, mlp, true}, seed));
  }
};

FieldTrainingOptions shortTraining() {
  FieldTrainingOptions options;
  options.epochs = 6;
  options.batch = 2;
  return options;
}

bool same(const FieldTrainingState& a, const FieldTrainingState& b) {
  return parametersOf(a.weights) == parametersOf(b.weights) && a.first == b.first && a.second == b.second &&
         a.step == b.step;
}

}  // namespace

TEST_CASE("an untrained field is the identity, other seeds draw other weights") {
  const Course course;
  const auto start = course.start();
  const JacobianField field(start.weights);
  for (const auto& pair : course.pairs) {
    CHECK(field.predict(pair.features) == pair.features.current);
    const auto output = field.deform(*pair.reference->poisson, pair.features);
    CHECK((pair.reference->poisson->jacobians(output) - pair.features.current).norm() < 1e-9);
  }
  CHECK(same(start, course.start(1)));
  CHECK_FALSE(same(start, course.start(2)));
  const auto& first = start.weights.source_net[0].weight;
  CHECK(first.squaredNorm() / float(first.size()) == Approx(2.0 / 56).epsilon(0.15));
}

TEST_CASE("parameters go back into the layers that they came from") {
  const Course course;
  auto weights = course.start().weights;
  const Eigen::VectorXf numbers = Eigen::VectorXf::LinSpaced(parametersOf(weights).size(), 0, 1);
  setParameters(numbers, weights);
  CHECK(parametersOf(weights) == numbers);
  CHECK(weights.source_net[0].weight(0, 1) == numbers[1]);
  CHECK(weights.source_net[0].bias[0] == numbers[16 * 56]);
  CHECK(weights.mlp.back().bias[8] == 1);
}

TEST_CASE("training two pairs of different topology overfits them") {
  const Course course(2);
  FieldTrainingOptions options;
  options.epochs = 700;
  options.batch = 2;
  options.learning_rate = 3e-3;
  options.last_learning_rate = 1e-4;
  std::vector<FieldEpoch> epochs;
  options.each_epoch = [&](const FieldEpoch& epoch, const FieldTrainingState&) { epochs.push_back(epoch); };
  const auto trained = trainJacobianField(course.pairs, course.start(1, {128, 128, 128}), options);
  CHECK(trained.termination == Termination::kIterationLimit);
  CHECK(trained.iterations == 700);
  REQUIRE(epochs.size() == 700);
  CHECK(epochs.front().loss.total > 100 * epochs.back().loss.total);
  CHECK(trained.residual == epochs.back().loss.total);
  CHECK(epochs.back().learning_rate == Approx(1e-4));
  const JacobianField field(trained.solution.weights);
  for (const auto& pair : course.pairs) {
    const auto& poisson = *pair.reference->poisson;
    const auto target = poisson.solve(poisson.jacobians(pair.target), pair.features.centroids);
    const auto source = poisson.solve(pair.features.current, pair.features.centroids);
    const auto output = field.deform(poisson, pair.features);
    CHECK(meanVertexDistance(output, target) < 0.15 * meanVertexDistance(source, target));
  }
}

TEST_CASE("the first loss is that of the sources, by its formula") {
  const Course course(1);
  const auto& pair = course.pairs[0];
  const auto& poisson = *pair.reference->poisson;
  FieldEpoch first{};
  auto options = shortTraining();
  options.epochs = 1;
  options.vertex_weight = 3;
  options.jacobian_weight = 0.5;
  options.each_epoch = [&](const FieldEpoch& epoch, const FieldTrainingState&) { first = epoch; };
  trainJacobianField(course.pairs, course.start(), options);
  const Eigen::VectorXd areas = poisson.areas();
  const double jacobian =
      (poisson.jacobians(pair.target) - pair.features.current).rowwise().squaredNorm().dot(areas) / areas.sum();
  const Vertices difference =
      poisson.solve(poisson.jacobians(pair.target) - pair.features.current, Vertices::Zero(1, 3));
  const auto& faces = poisson.topology().faces();
  double vertex = 0;
  for (Eigen::Index f = 0; f < faces.rows(); ++f)
    for (int c = 0; c < 3; ++c) vertex += areas[f] / 3 / areas.sum() * difference.row(faces(f, c)).squaredNorm();
  CHECK(first.loss.jacobian == Approx(jacobian).epsilon(1e-6));
  CHECK(first.loss.vertex == Approx(vertex).epsilon(1e-6));
  CHECK(first.loss.total == Approx(3 * vertex + 0.5 * jacobian).epsilon(1e-6));
}

TEST_CASE("training gives the same bits each time and with any number of threads, other bits with another seed") {
  const Course course;
  auto options = shortTraining();
  const auto once = trainJacobianField(course.pairs, course.start(), options);
  CHECK(same(once.solution, trainJacobianField(course.pairs, course.start(), options).solution));
  {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    CHECK(same(once.solution, trainJacobianField(course.pairs, course.start(), options).solution));
  }
  options.seed = 2;
  CHECK_FALSE(same(once.solution, trainJacobianField(course.pairs, course.start(), options).solution));
}

TEST_CASE("training that was stopped anywhere and resumed from its checkpoint gives the bits of one that was not") {
  const TemporaryFolder folder;
  const Course course;
  auto options = shortTraining();
  options.batch = 1;
  std::vector<FieldEpoch> whole, parts;
  options.each_epoch = [&](const FieldEpoch& epoch, const FieldTrainingState&) { whole.push_back(epoch); };
  const auto uninterrupted = trainJacobianField(course.pairs, course.start(), options);
  std::stop_source stop;
  options.stop = stop.get_token();
  options.each_epoch = [&](const FieldEpoch& epoch, const FieldTrainingState& state) {
    parts.push_back(epoch);
    if (epoch.epoch == 2) writeFieldCheckpoint(folder / "state", state, "lessons"), stop.request_stop();
  };
  const auto stopped = trainJacobianField(course.pairs, course.start(), options);
  CHECK(stopped.termination == Termination::kCancelled);
  CHECK(stopped.iterations == 6);
  const auto checkpoint = readFieldCheckpoint(folder / "state");
  CHECK(checkpoint.training == "lessons");
  CHECK(same(checkpoint.state, stopped.solution));
  options.stop = {};
  const auto resumed = trainJacobianField(course.pairs, checkpoint.state, options);
  CHECK(same(resumed.solution, uninterrupted.solution));
  REQUIRE(parts.size() == whole.size());
  for (std::size_t i = 0; i < parts.size(); ++i) CHECK(parts[i].loss.total == whole[i].loss.total);
}

TEST_CASE("a stop in the middle of an epoch loses no step") {
  const Course course;
  auto options = shortTraining();
  options.batch = 1;
  const auto uninterrupted = trainJacobianField(course.pairs, course.start(), options);
  auto state = course.start();
  // Whenever that is, the answer is the same.
  int epochs = 0;
  std::stop_source stop;
  options.stop = stop.get_token();
  options.each_epoch = [&](const FieldEpoch&, const FieldTrainingState&) { ++epochs; };
  std::jthread breaker([&] { std::this_thread::sleep_for(std::chrono::milliseconds(60)), stop.request_stop(); });
  state = trainJacobianField(course.pairs, state, options).solution;
  options.stop = {};
  const auto resumed = trainJacobianField(course.pairs, state, options);
  CHECK(same(resumed.solution, uninterrupted.solution));
  CHECK(epochs == 6);
}

TEST_CASE("training stops where numbers are no longer finite, with what it had") {
  const Course course(1);
  auto options = shortTraining();
  options.learning_rate = options.last_learning_rate = 1e20;
  const auto failed = trainJacobianField(course.pairs, course.start(), options);
  CHECK(failed.termination == Termination::kNumericalFailure);
  CHECK(parametersOf(failed.solution.weights).allFinite());
}

TEST_CASE("training refuses what it could not work on") {
  const Course course(1);
  auto options = shortTraining();
  options.epochs = 0;
  CHECK_THROWS_WITH(trainJacobianField(course.pairs, course.start(), options), "options: epochs = 0, want >= 1");
  options.epochs = 1;
  options.learning_rate = -1;
  CHECK_THROWS_WITH(trainJacobianField(course.pairs, course.start(), options), Catch::Contains("learning_rate = -1"));
  CHECK_THROWS_WITH(trainJacobianField({}, course.start()), Catch::Contains("pairs: are none"));
  auto state = course.start();
  state.first.conservativeResize(7);
  CHECK_THROWS_WITH(trainJacobianField(course.pairs, state), Catch::Contains("state: has 7 and"));
  CHECK_THROWS_WITH(untrainedField(course.scaling, {{64, 0}, {64}, {64}, false}, 1),
                    "architecture: source_net[1] = 0, want 1 to 4096");
  const auto& [reference, source, target, scan] = course.lessons[0];
  CHECK_THROWS_WITH(makeFieldPair(reference, source, target.topRows(5), scan, course.scaling),
                    Catch::Contains("target: has 5 vertices, want 82"));
}

TEST_CASE("damaged checkpoints are refused") {
  const TemporaryFolder folder;
  writeFieldCheckpoint(folder / "state", Course(1).start(), "");
  auto bytes = bytesOf(folder / "state");
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] + 1);
  CHECK_THROWS_WITH(readFieldCheckpoint(folder.file("damaged", bytes)), Catch::Contains("SHA-256"));
}
