#include "core/editing/anchored_fit.h"

#include <catch2/catch.hpp>

#include "core/mesh/alignment.h"
#include "tests/support/finite_differences.h"
#include "tests/support/literal_shell_energy.h"
#include "tests/support/submanifolds.h"

using namespace shaped;
using namespace shaped::test;

namespace {

const std::vector<std::int32_t> kPulled{1, 12, 20, 33, 40};

struct Problem {
  TrainingSet set = variedTubes();
  Vertices prior = set.shapes[1];
  std::vector<AnchorTarget> targets = targetsOn(*set.mesh.topology, set.shapes[2], kPulled);
  Vertices start = apply(alignRigidly(set.shapes[1], set.shapes[2]), set.shapes[1]);
};

}  // namespace

TEST_CASE("an anchored fit balances the pulls of its targets and the shell's resistance, by an independent energy") {
  Problem problem;
  problem.targets[0].weight = 3;
  problem.targets[2].anchor.barycentric = {0.2, 0.5, 0.3};  // inside a face
  const double gamma = 0.7;
  const auto& topology = *problem.set.mesh.topology;
  const auto energy = [&](const Vertices& s) {
    double sum = gamma * literalShellEnergy(topology, s, problem.prior, problem.set.calculus->bending());
    for (const auto& target : problem.targets) {
      Eigen::Vector3d point = Eigen::Vector3d::Zero();
      for (int c = 0; c < 3; ++c)
        point += target.anchor.barycentric[c] * s.row(topology.faces()(target.anchor.face, c)).transpose();
      sum += target.weight * (point - target.position).squaredNorm();
    }
    return sum;
  };
  const auto fit =
      fitAnchored(*problem.set.calculus, problem.prior, problem.targets, problem.start, {gamma, 60, 1e-10, {}});
  REQUIRE(fit.converged());
  CHECK(energy(fit.solution) < 0.5 * energy(problem.start));
  const double at_start = differenceGradient(energy, problem.start, 1e-4).norm();
  CHECK(differenceGradient(energy, fit.solution, 1e-4).norm() < 1e-6 * at_start);
}

TEST_CASE("an anchored fit turns with its targets") {
  const Problem problem;
  const AnchoredFitOptions options{1, 60, 1e-10, {}};
  const auto fit = fitAnchored(*problem.set.calculus, problem.prior, problem.targets, problem.start, options);
  const auto motion = alignRigidly(problem.set.shapes[2], moveRigidly(problem.set.shapes[2], 9));
  auto moved = problem.targets;
  for (auto& target : moved) target.position = apply(motion, Vertices(target.position.transpose())).transpose();
  const auto turned = fitAnchored(*problem.set.calculus, problem.prior, moved, apply(motion, problem.start), options);
  CHECK((turned.solution - apply(motion, fit.solution)).norm() < 1e-6);
  moved[0].position[0] += 0.1;  // the control: a target that moves alone changes the shape
  const auto pulled = fitAnchored(*problem.set.calculus, problem.prior, moved, apply(motion, problem.start), options);
  CHECK(rigidGap(pulled.solution, fit.solution) > 1e-3);
}

TEST_CASE("heavier targets are met more closely, and a weight of zero does not pull") {
  Problem problem;
  const auto missOf = [&](double weight) {
    for (auto& target : problem.targets) target.weight = weight;
    const auto fit =
        fitAnchored(*problem.set.calculus, problem.prior, problem.targets, problem.start, {1, 60, 1e-8, {}});
    return (anchorPositions(*problem.set.mesh.topology, problem.targets, fit.solution) -
            problem.set.shapes[2](kPulled, Eigen::all))
        .norm();
  };
  const double light = missOf(0.1), heavy = missOf(10);
  CHECK(heavy < 0.2 * light);

  for (auto& target : problem.targets) target.weight = 1;
  auto with_ghost = problem.targets;
  with_ghost.push_back({anchorAt(*problem.set.mesh.topology, 5), Eigen::Vector3d(9, 9, 9), 0});
  const AnchoredFitOptions options{1, 60, 1e-10, {}};
  const auto without = fitAnchored(*problem.set.calculus, problem.prior, problem.targets, problem.start, options);
  const auto with = fitAnchored(*problem.set.calculus, problem.prior, with_ghost, problem.start, options);
  CHECK((with.solution - without.solution).norm() == 0);
}

TEST_CASE("three targets off a line determine a placement, fewer or collinear ones do not") {
  const auto at = [](double x, double y, double weight) { return AnchorTarget{{}, Eigen::Vector3d(x, y, 0), weight}; };
  CHECK(determinePlacement({at(0, 0, 1), at(1, 0, 1), at(0, 1, 1)}));
  CHECK(!determinePlacement({at(0, 0, 1), at(1, 0, 1)}));
  CHECK(!determinePlacement({at(0, 0, 1), at(1, 1, 1), at(2, 2, 1), at(5, 5, 1)}));
  CHECK(!determinePlacement({at(0, 0, 1), at(1, 0, 1), at(0, 1, 0)}));  // the third does not count
  CHECK(!determinePlacement({at(1, 2, 1), at(1, 2, 1), at(1, 2, 1)}));
}
