#include "core/mesh/surface_neighbours.h"

#include <catch2/catch.hpp>
#include <map>

#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;

namespace {

/// Distances along edges from one vertex to all, by relaxing every edge until nothing changes.
Eigen::VectorXd allDistances(const Topology& topology, const Vertices& shape, std::int32_t start) {
  Eigen::VectorXd distance = Eigen::VectorXd::Constant(topology.vertexCount(), 1e9);
  distance[start] = 0;
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& [a, b] : topology.edges()) {
      const double length = (shape.row(a) - shape.row(b)).norm();
      for (const auto& [from, to] : {std::pair{a, b}, std::pair{b, a}})
        if (distance[from] + length < distance[to]) distance[to] = distance[from] + length, changed = true;
    }
  }
  return distance;
}

}  // namespace

TEST_CASE("nearest marked vertices agree with all distances") {
  const auto mesh = icosphere(2);
  const Vertices shape = jitter(mesh.vertices, 0.05, 1);
  std::vector<std::int32_t> marked;
  for (int v = 0; v < 162; v += 6) marked.push_back(v);
  const auto neighbours = nearestMarked(*mesh.topology, shape, marked, 5);
  for (const int vertex : {0, 1, 77, 161}) {
    const auto distance = allDistances(*mesh.topology, shape, vertex);
    std::multimap<double, std::int32_t> sorted;
    for (std::size_t m = 0; m < marked.size(); ++m) sorted.emplace(distance[marked[m]], static_cast<int>(m));
    REQUIRE(neighbours[vertex].size() == 5);
    auto expected = sorted.begin();
    for (const auto& neighbour : neighbours[vertex]) {
      CHECK(neighbour.mark == expected->second);
      CHECK(neighbour.distance == Approx(expected->first).margin(1e-14));
      ++expected;
    }
  }
}

TEST_CASE("the way to a neighbour runs along the surface, not through space") {
  const auto mesh = tube(30, 8);
  const Vertices ring = bend(mesh.vertices, 6.0);  // the two ends nearly touch
  const std::int32_t first = 0, last = 29 * 8;
  const auto neighbours = nearestMarked(*mesh.topology, ring, {first, last}, 2);
  CHECK((ring.row(first) - ring.row(last)).norm() < 1);
  CHECK(neighbours[first][1].distance > 2.5);
}

TEST_CASE("a component with few marks gives few neighbours") {
  const auto one = icosphere(0);
  Vertices both(24, 3);
  both << one.vertices, (one.vertices.array() + 5).matrix();
  Faces faces(40, 3);
  faces << one.topology->faces(), one.topology->faces().array() + 12;
  const auto neighbours = nearestMarked(Topology(24, faces), both, {3, 4, 20}, 2);
  CHECK(neighbours[0].size() == 2);
  CHECK(neighbours[15].size() == 1);
  CHECK(neighbours[15][0].mark == 2);
}
