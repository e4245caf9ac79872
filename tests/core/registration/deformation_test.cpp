#include "core/registration/deformation.h"

#include <catch2/catch.hpp>
#include <functional>

#include "core/registration/fitting_step.h"
#include "tests/core/registration/scanned_shapes.h"

using namespace shaped;
using namespace shaped::test;

namespace {

using State = Eigen::MatrixXd;

std::vector<std::unique_ptr<Deformation>> allDeformations(const Mesh& mesh) {
  std::vector<std::unique_ptr<Deformation>> all;
  all.push_back(affineDeformation(*mesh.topology, mesh.vertices, 0.3));
  all.push_back(freeDisplacement(*mesh.topology, mesh.vertices));
  all.push_back(keptEdgeLengths(*mesh.topology, mesh.vertices));
  return all;
}

State randomState(const Deformation& deformation, double amount, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-amount, amount);
  return deformation.start().unaryExpr([&](double x) { return x + uniform(random); });
}

/// Largest difference between a gradient and central differences, over a few entries, relative to the gradient.
double gradientError(const std::function<double(const State&)>& value, const State& gradient, const State& at) {
  double worst = 0;
  const double step = 1e-5;
  for (Eigen::Index entry = 0; entry < at.size(); entry += 37) {
    State moved = at;
    moved(entry) += step;
    const double above = value(moved);
    moved(entry) -= 2 * step;
    worst = std::max(worst, std::abs((above - value(moved)) / (2 * step) - gradient(entry)));
  }
  return worst / gradient.cwiseAbs().maxCoeff();
}

/// A state of maps that all equal x -> linear x + shift.
State affineState(const Deformation& deformation, const Mesh& mesh, const Eigen::Matrix3d& linear,
                  const Eigen::RowVector3d& shift) {
  State state = deformation.start();
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    state.middleRows<3>(4 * v) = linear.transpose();
    state.row(4 * v + 3) = mesh.vertices.row(v) * linear.transpose() + shift;
  }
  return state;
}

Pulls somePulls(const Deformation& deformation, const Mesh& mesh) {
  Pulls pulls{jitter(mesh.vertices, 0.2, 3), Eigen::VectorXd::Constant(mesh.vertices.rows(), 0.01), {}};
  for (Eigen::Index v = 0; v < pulls.weights.size(); v += 3) pulls.weights[v] = 0;
  pulls.landmarks.push_back({deformation.landmark({5, {0.2, 0.5, 0.3}, {0, 0, 0}}), {1.5, 0, 0.2}, 0.7});
  return pulls;
}

}  // namespace

TEST_CASE("gradients of the deformation energies are those of central differences") {
  const Mesh mesh = icosphere(2);
  for (const auto& deformation : allDeformations(mesh)) {
    const State at = randomState(*deformation, 0.1, 4);
    CHECK(gradientError([&](const State& s) { return deformation->energy(s); }, deformation->gradient(at), at) < 1e-7);
    const Pulls pulls = somePulls(*deformation, mesh);
    CHECK(gradientError([&](const State& s) { return pulls.energy(*deformation, s); }, pulls.gradient(*deformation, at),
                        at) < 1e-7);
  }
}

TEST_CASE("a global affine map costs nothing, a bend does") {
  const Mesh mesh = tube(20, 12);
  const auto deformation = affineDeformation(*mesh.topology, mesh.vertices, 0.3);
  Eigen::Matrix3d linear;
  linear << 1.2, 0.3, 0, -0.1, 0.8, 0.2, 0, 0.4, 1.5;
  CHECK(deformation->energy(affineState(*deformation, mesh, linear, {3, -1, 2})) < 1e-20);
  State bent = deformation->start();
  const Vertices shape = bend(mesh.vertices, 1);
  for (Eigen::Index v = 0; v < shape.rows(); ++v) bent.row(4 * v + 3) = shape.row(v);
  CHECK(deformation->energy(bent) > 0.1);
}

TEST_CASE("the affine energy is the literal sum over edges of |(X_i - X_j) G|^2") {
  const Mesh mesh = icosphere(1);
  const double turn_length = 0.4;
  const auto deformation = affineDeformation(*mesh.topology, mesh.vertices, turn_length);
  const State state = randomState(*deformation, 0.3, 8);
  double sum = 0;
  const auto map = [&](int v) {  // [A | p - A v], 3 x 4
    Eigen::Matrix<double, 3, 4> x;
    x.leftCols<3>() = state.middleRows<3>(4 * v).transpose();
    x.col(3) = state.row(4 * v + 3).transpose() - x.leftCols<3>() * mesh.vertices.row(v).transpose();
    return x;
  };
  for (const auto& [i, j] : mesh.topology->edges()) {
    Eigen::Matrix4d weights = Eigen::Vector4d(turn_length, turn_length, turn_length, 1).asDiagonal();
    weights.topRightCorner<3, 1>() = 0.5 * (mesh.vertices.row(i) + mesh.vertices.row(j)).transpose();
    sum += ((map(i) - map(j)) * weights).squaredNorm();
  }
  CHECK(deformation->energy(state) == Approx(sum));
}

TEST_CASE("the energies do not see a rigid motion; only edge lengths and affine maps ignore one of the shape alone") {
  const Mesh mesh = icosphere(2);
  const RigidMotion motion = randomMotion(3);
  Mesh elsewhere = mesh;
  elsewhere.vertices = apply(motion, mesh.vertices);
  const auto here = allDeformations(mesh), there = allDeformations(elsewhere);
  for (std::size_t kind = 0; kind < here.size(); ++kind) {
    const State state = randomState(*here[kind], 0.1, 6);
    State both = state * motion.rotation.transpose();  // of scan and template
    const int stride = kind == 0 ? 4 : 1;
    for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
      both.row(here[kind]->positionRow(v)) += motion.translation.transpose();
      if (stride == 4) both.middleRows<3>(4 * v) = motion.rotation * both.middleRows<3>(4 * v).eval();
    }
    CHECK(there[kind]->energy(both) == Approx(here[kind]->energy(state)));
  }
  CHECK(here[0]->energy(affineState(*here[0], mesh, motion.rotation, motion.translation.transpose())) < 1e-20);
  CHECK(here[2]->energy(elsewhere.vertices) < 1e-20);
  CHECK(here[1]->energy(elsewhere.vertices) > 1);
}

TEST_CASE("the quadratic bound touches the energy and lies above it everywhere") {
  const Mesh mesh = icosphere(2);
  for (const auto& deformation : allDeformations(mesh)) {
    const State at = randomState(*deformation, 0.2, 5),
                right =
                    State(deformation->bound().selfadjointView<Eigen::Lower>() * at) - 0.5 * deformation->gradient(at);
    const auto bound = [&](const State& s) {
      const State image = deformation->bound().selfadjointView<Eigen::Lower>() * s;
      return s.cwiseProduct(image).sum() - 2 * s.cwiseProduct(right).sum();
    };
    const double constant = deformation->energy(at) - bound(at);
    for (unsigned seed = 20; seed < 30; ++seed) {
      const State other = randomState(*deformation, 0.05 * (seed - 19), seed);
      CHECK(bound(other) + constant >= deformation->energy(other) - 1e-10);
    }
  }
}

TEST_CASE("after a step the gradient of the energy is zero where it is quadratic, and the energy falls where not") {
  const Mesh mesh = icosphere(2);
  const auto all = allDeformations(mesh);
  for (const auto& deformation : all) {
    const Pulls pulls = somePulls(*deformation, mesh);
    const auto value = [&](const State& s) { return pulls.energy(*deformation, s) + 0.05 * deformation->energy(s); };
    State state = deformation->start();
    const double before = value(state);
    const State first = pulls.gradient(*deformation, state) + 0.05 * deformation->gradient(state);
    FittingSteps steps(*deformation, 0.05);
    REQUIRE(steps.take(pulls, 1e-10, state));
    CHECK(value(state) < 0.9 * before);
    double last = value(state);
    for (int step = 0; step < 400; ++step) {
      REQUIRE(steps.take(pulls, 1e-3, state));
      REQUIRE(value(state) <= last * (1 + 1e-12));
      last = value(state);
    }
    // edge lengths come near their minimum by and by
    const bool quadratic = deformation != all.back();
    const double reached = quadratic ? 1e-8 : 1e-3;
    const State settled = pulls.gradient(*deformation, state) + 0.05 * deformation->gradient(state);
    CHECK(settled.cwiseAbs().maxCoeff() < reached * first.cwiseAbs().maxCoeff());
  }
  const auto affine = affineDeformation(*mesh.topology, mesh.vertices, 0.3);
  State state = affine->start();
  const Pulls pulls = somePulls(*affine, mesh);
  const State first = pulls.gradient(*affine, state);
  REQUIRE(FittingSteps(*affine, 0.05).take(pulls, 1e-10, state));
  const State once = pulls.gradient(*affine, state) + 0.05 * affine->gradient(state);
  CHECK(once.cwiseAbs().maxCoeff() < 1e-7 * first.cwiseAbs().maxCoeff());
  State nudged = state;
  const auto value = [&](const State& s) { return pulls.energy(*affine, s) + 0.05 * affine->energy(s); };
  for (Eigen::Index entry = 0; entry < state.size(); entry += 31) {  // the same by central differences
    nudged(entry) += 1e-4;
    const double above = value(nudged);
    nudged(entry) -= 2e-4;
    CHECK(std::abs(above - value(nudged)) / 2e-4 < 1e-7);
    nudged(entry) = state(entry);
  }
}

TEST_CASE("steps with an earlier factor come to the same as steps that are factorised anew") {
  const Mesh mesh = icosphere(3);
  for (const auto& deformation : allDeformations(mesh)) {
    FittingSteps kept(*deformation, 0.01);
    State with = deformation->start(), anew = with;
    for (int step = 0; step < 6; ++step) {
      Pulls pulls = somePulls(*deformation, mesh);
      pulls.targets = jitter(mesh.vertices, 0.1, unsigned(step));
      pulls.weights *= 1 + 0.5 * step;
      REQUIRE(kept.take(pulls, 1e-10, with));
      REQUIRE(FittingSteps(*deformation, 0.01).take(pulls, 1e-10, anew));
      CHECK((with - anew).norm() < 1e-7 * anew.norm());
    }
  }
}

TEST_CASE("a landmark off the surface goes with the affine map") {
  const Mesh mesh = icosphere(2);
  const auto deformation = affineDeformation(*mesh.topology, mesh.vertices, 0.3);
  const Anchor anchor{12, {0.3, 0.3, 0.4}, {0.01, -0.02, 0.05}};
  const Eigen::Vector3d at = position(anchor, mesh.topology->faces(), mesh.vertices);
  const auto landmark = deformation->landmark(anchor);
  CHECK((landmark.at(deformation->start()).transpose() - at).norm() < 1e-14);
  Eigen::Matrix3d linear;
  linear << 1.2, 0.3, 0, -0.1, 0.8, 0.2, 0, 0.4, 1.5;
  const State state = affineState(*deformation, mesh, linear, {1, 2, 3});
  CHECK((landmark.at(state).transpose() - (linear * at + Eigen::Vector3d(1, 2, 3))).norm() < 1e-14);
}

TEST_CASE("a step that is stopped or not finite leaves the state alone") {
  const Mesh mesh = icosphere(2);
  const auto deformation = affineDeformation(*mesh.topology, mesh.vertices, 0.3);
  State state = deformation->start();
  Pulls pulls = somePulls(*deformation, mesh);
  std::stop_source stop;
  stop.request_stop();
  FittingSteps steps(*deformation, 1);
  CHECK_FALSE(steps.take(pulls, 1e-3, state, stop.get_token()));
  pulls.targets(1, 1) = NAN;
  CHECK_FALSE(steps.take(pulls, 1e-3, state));
  CHECK(state == deformation->start());
}

TEST_CASE("without any pull the template stays where it is") {
  const Mesh mesh = icosphere(2);
  for (const auto& deformation : allDeformations(mesh)) {
    State state = deformation->start();
    REQUIRE(FittingSteps(*deformation, 1).take({mesh.vertices, Eigen::VectorXd::Zero(162), {}}, 1e-3, state));
    CHECK((deformation->vertices(state) - mesh.vertices).cwiseAbs().maxCoeff() < 1e-5);
  }
}
