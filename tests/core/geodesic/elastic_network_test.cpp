#include "core/geodesic/elastic_network.h"

#include <tbb/global_control.h>

#include <catch2/catch.hpp>
#include <numeric>

#include "core/numerics/error.h"
#include "core/numerics/threads.h"
#include "tests/support/calculus.h"
#include "tests/support/dense_descent.h"
#include "tests/support/literal_forces.h"
#include "tests/support/literal_shell_energy.h"

using namespace shaped;
using namespace shaped::test;

namespace {

struct Setting {
  Mesh mesh = tube(7, 6);
  ShellStructurePtr structure = std::make_shared<const ShellStructure>(mesh.topology);
  double eta = 1e-3;
  Vertices bent(double angle) const { return bend(mesh.vertices, angle); }
};

/// A tree with two free inner nodes (0, 1), three fixed ends on the first and two on the second, uneven weights and
/// both orientations.
ElasticNetwork bush(const Setting& s) {
  ElasticNetwork network;
  network.nodes = {
      s.bent(0),   s.bent(0.1),       s.bent(0.8), moveRigidly(s.bent(-0.5), 1), jitter(s.bent(0.2), 0.03, 2),
      s.bent(1.5), 1.1 * s.bent(-0.2)};
  network.free = {true, true, false, false, false, false, false};
  network.segments = {{2, 0, 1}, {0, 3, 0.5}, {4, 0, 2}, {0, 1, 1.5}, {5, 1, 1}, {1, 6, 0.7}};
  return network;
}

double weightedEnergy(const Setting& s, const ElasticNetwork& network) {
  const auto energies = segmentEnergies(*s.mesh.topology, s.eta, network);
  double sum = 0;
  for (std::size_t k = 0; k < energies.size(); ++k) sum += network.segments[k].weight * energies[k];
  return sum;
}

/// Literal force balance of one node.
double imbalanceOf(const Setting& s, const ElasticNetwork& network, std::int32_t node) {
  std::vector<Vertices> forces;
  for (const auto& [from, to, weight] : network.segments) {
    const auto& a = network.nodes[static_cast<std::size_t>(from)];
    const auto& b = network.nodes[static_cast<std::size_t>(to)];
    if (from == node) forces.push_back(weight * literalFirstForce(*s.mesh.topology, a, b, s.eta));
    if (to == node) forces.push_back(weight * literalSecondForce(*s.mesh.topology, a, b, s.eta));
  }
  return relativeImbalance(forces);
}

}  // namespace

TEST_CASE("a relaxed network balances the literal forces in every free node and leaves the others alone") {
  const Setting s;
  const auto network = bush(s);
  const auto relaxed = relax(s.structure, s.eta, network, {});
  REQUIRE(relaxed.converged());
  CHECK(relaxed.residual <= 1e-8);
  CHECK(imbalanceOf(s, network, 0) > 1e-2);  // the control: the start is out of balance
  for (const std::int32_t node : {0, 1}) CHECK(imbalanceOf(s, relaxed.solution, node) < 2e-8);
  for (std::size_t n = 2; n < network.nodes.size(); ++n) CHECK(relaxed.solution.nodes[n] == network.nodes[n]);
  CHECK(weightedEnergy(s, relaxed.solution) < weightedEnergy(s, network));
}

TEST_CASE("segment energies are the literal energies of the segments, in order") {
  const Setting s;
  const auto network = bush(s);
  const auto energies = segmentEnergies(*s.mesh.topology, s.eta, network);
  REQUIRE(energies.size() == network.segments.size());
  for (std::size_t k = 0; k < energies.size(); ++k) {
    const auto& segment = network.segments[k];
    CHECK(energies[k] ==
          Approx(literalShellEnergy(*s.mesh.topology, network.nodes[static_cast<std::size_t>(segment.from)],
                                    network.nodes[static_cast<std::size_t>(segment.to)], s.eta))
              .epsilon(1e-9));
  }
}

TEST_CASE("the relaxed energy is the one that a slow dense method reaches on the literal energy") {
  Setting s;
  s.mesh = icosphere(0);
  s.structure = std::make_shared<const ShellStructure>(s.mesh.topology);
  s.eta = 0.02;
  const Vertices a = jitter(s.mesh.vertices, 0.15, 1), b = jitter(1.3 * s.mesh.vertices, 0.15, 2);
  ElasticNetwork network{{a, a, b, b}, {false, true, true, false}, {{0, 1, 3}, {1, 2, 3}, {2, 3, 3}}};
  network.nodes[1] = jitter(2.0 / 3 * a + 1.0 / 3 * b, 0.1, 3);
  network.nodes[2] = jitter(1.0 / 3 * a + 2.0 / 3 * b, 0.1, 4);
  const auto relaxed = relax(s.structure, s.eta, network, {});
  REQUIRE(relaxed.converged());

  const auto count = a.size();
  Eigen::VectorXd start(2 * count);
  start << Eigen::Map<const Eigen::VectorXd>(network.nodes[1].data(), count),
      Eigen::Map<const Eigen::VectorXd>(network.nodes[2].data(), count);
  const auto pathOf = [&](const Eigen::VectorXd& x) {
    return std::vector<Vertices>{a, Eigen::Map<const Vertices>(x.data(), a.rows(), 3),
                                 Eigen::Map<const Vertices>(x.data() + count, a.rows(), 3), b};
  };
  const auto energy = [&](const Eigen::VectorXd& x) { return literalPathEnergy(*s.mesh.topology, pathOf(x), s.eta); };
  const auto slow = denseDescent(energy, start, 250);
  CHECK(weightedEnergy(s, relaxed.solution) == Approx(energy(slow)).epsilon(1e-9));
  CHECK(weightedEnergy(s, relaxed.solution) < 0.99 * energy(start));
  CHECK(rigidGap(relaxed.solution.nodes[1], pathOf(slow)[1]) < 1e-4);
  CHECK(rigidGap(relaxed.solution.nodes[2], pathOf(slow)[2]) < 1e-4);
}

TEST_CASE("relaxing gives the same bits whatever the number of threads") {
  limitLibraryThreads();
  const Setting s;
  std::vector<ElasticNetwork> results;
  for (const std::size_t threads : {1, 2, 5}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    results.push_back(relax(s.structure, s.eta, bush(s), {}).solution);
  }
  for (std::size_t n = 0; n < results[0].nodes.size(); ++n) {
    CHECK(results[0].nodes[n] == results[1].nodes[n]);
    CHECK(results[0].nodes[n] == results[2].nodes[n]);
  }
}

TEST_CASE("networks that are no anchored forest are refused, each with the reason") {
  const Setting s;
  const Vertices& shape = s.mesh.vertices;
  const auto refused = [&](std::vector<bool> free, std::vector<ElasticSegment> segments, const std::string& reason) {
    INFO(reason);
    ElasticNetwork network{std::vector<Vertices>(free.size(), shape), std::move(free), std::move(segments)};
    CHECK_THROWS_AS(relax(s.structure, s.eta, network, {}), InvalidInput);
    CHECK_THROWS_WITH(relax(s.structure, s.eta, network, {}), Catch::Contains(reason));
  };
  refused({true, true, true, false}, {{0, 1, 1}, {1, 2, 1}, {2, 0, 1}, {0, 3, 1}}, "loop");
  refused({true, true, false}, {{0, 1, 1}, {1, 0, 1}, {1, 2, 1}}, "loop");
  refused({true, true, false}, {{0, 1, 1}}, "without a fixed one");
  refused({true, true, false}, {{0, 2, 1}}, "without a fixed one");
  refused({true, false}, {{0, 2, 1}}, "segments[0]");
  refused({true, false}, {{0, 1, 1}, {-1, 1, 1}}, "segments[1]");
  refused({true, false}, {{0, 1, 1}, {0, 0, 1}}, "to itself");
  refused({true, false}, {{0, 1, 0}}, "positive weight");
  refused({true, false}, {{0, 1, std::nan("")}}, "positive weight");
}

TEST_CASE("a network says truthfully how it ended") {
  const Setting s;
  const auto network = bush(s);
  SECTION("nothing to move: converged at once") {
    auto still = network;
    still.free.assign(still.nodes.size(), false);
    const auto relaxed = relax(s.structure, s.eta, still, {});
    CHECK(relaxed.converged());
    CHECK(relaxed.iterations == 0);
  }
  SECTION("iteration limit: better than the start") {
    NetworkOptions options;
    options.max_iterations = 1;
    options.tolerance = 1e-13;
    const auto relaxed = relax(s.structure, s.eta, network, options);
    CHECK(relaxed.termination == Termination::kIterationLimit);
    CHECK(relaxed.iterations == 1);
    CHECK(relaxed.residual > 1e-13);
    CHECK(weightedEnergy(s, relaxed.solution) < weightedEnergy(s, network));
  }
  SECTION("cancelled: no step after the token fired, and every iteration was announced") {
    std::stop_source source;
    std::vector<double> residuals;
    NetworkOptions options;
    options.stop = source.get_token();
    options.on_iteration = [&](int iteration, double residual) {
      CHECK(iteration == static_cast<int>(residuals.size()));
      residuals.push_back(residual);
      if (iteration == 1) source.request_stop();
    };
    const auto relaxed = relax(s.structure, s.eta, network, options);
    CHECK(relaxed.termination == Termination::kCancelled);
    CHECK(relaxed.iterations == 1);
    CHECK(residuals.size() == 2);
    CHECK(relaxed.residual == residuals.back());
    CHECK(weightedEnergy(s, relaxed.solution) < weightedEnergy(s, network));
  }
  SECTION("a shape with a collapsed triangle: numerical failure, the start unchanged") {
    auto broken = network;
    broken.nodes[1].row(3) = broken.nodes[1].row(4);
    const auto relaxed = relax(s.structure, s.eta, broken, {});
    CHECK(relaxed.termination == Termination::kNumericalFailure);
    for (std::size_t n = 0; n < broken.nodes.size(); ++n) CHECK(relaxed.solution.nodes[n] == broken.nodes[n]);
  }
}
