#include "core/mesh/topology.h"

#include <catch2/catch.hpp>
#include <limits>

#include "core/numerics/error.h"

using namespace shaped;

namespace {

Faces faces(std::initializer_list<std::array<int, 3>> list) {
  Faces result(static_cast<Eigen::Index>(list.size()), 3);
  Eigen::Index f = 0;
  for (const auto& face : list) result.row(f++) << face[0], face[1], face[2];
  return result;
}

const Faces tetrahedron = faces({{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}});

}  // namespace

TEST_CASE("a tetrahedron has six edges, each a hinge, and one component") {
  const Topology topology(4, tetrahedron);
  CHECK(topology.edges().size() == 6);
  CHECK(topology.hinges().size() == 6);
  CHECK(topology.closed());
  CHECK(topology.componentCount() == 1);
}

TEST_CASE("hinges name their stencil consistently") {
  const Topology topology(4, tetrahedron);
  for (const auto& hinge : topology.hinges()) {
    const auto& v = hinge.vertices;
    const std::array<std::array<int, 2>, 5> ends{{{v[0], v[1]}, {v[1], v[2]}, {v[2], v[0]}, {v[0], v[3]}, {v[3], v[1]}}};
    for (int k = 0; k < 5; ++k) {
      const auto& edge = topology.edges()[hinge.edges[k]];
      CHECK(edge[0] == std::min(ends[k][0], ends[k][1]));
      CHECK(edge[1] == std::max(ends[k][0], ends[k][1]));
    }
    // the first face holds v0 -> v1 in this order
    bool found = false;
    for (int c = 0; c < 3; ++c)
      found |= topology.faces()(hinge.faces[0], c) == v[0] && topology.faces()(hinge.faces[0], (c + 1) % 3) == v[1];
    CHECK(found);
  }
}

TEST_CASE("the id depends on the faces and on nothing else") {
  CHECK(Topology(4, tetrahedron).id() == Topology(4, tetrahedron).id());
  CHECK(Topology(4, tetrahedron).id() != Topology(4, faces({{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {0, 2, 3}})).id());
  CHECK(Topology(4, tetrahedron).id().size() == 32);
}

TEST_CASE("two tetrahedra without a common vertex are two components") {
  Faces both(8, 3);
  both << tetrahedron, tetrahedron.array() + 4;
  const Topology topology(8, both);
  CHECK(topology.componentCount() == 2);
  CHECK(topology.components()[5] == 1);
  CHECK_THROWS_WITH(requireOneComponent(topology, "template"), Catch::Contains("template: has 2 connected components"));
}

TEST_CASE("faulty connectivity is refused with the place named") {
  CHECK_THROWS_WITH(Topology(4, faces({{0, 1, 4}})), Catch::Contains("faces[0]: vertex index 4"));
  CHECK_THROWS_WITH(Topology(4, faces({{0, 1, 1}})), Catch::Contains("faces[0]: repeats vertex 1"));
  CHECK_THROWS_WITH(Topology(5, faces({{0, 1, 2}, {1, 0, 3}, {0, 1, 4}})), Catch::Contains("edge (0, 1) has 3 faces"));
  CHECK_THROWS_WITH(Topology(4, faces({{0, 1, 2}, {0, 1, 3}})), Catch::Contains("faces[1]: edge (0, 1) runs the same way"));
  CHECK_THROWS_WITH(Topology(4, faces({{0, 1, 2}})), Catch::Contains("vertices[3]: belongs to no face"));
  CHECK_THROWS_WITH(Topology(5, faces({{0, 1, 2}, {0, 3, 4}})), Catch::Contains("vertices[0]: joins several sheets"));
  Faces cones(8, 3);  // two closed tetrahedra that share vertex 0 only
  cones << tetrahedron, tetrahedron.unaryExpr([](int v) { return v == 0 ? 0 : v + 3; });
  CHECK_THROWS_WITH(Topology(7, cones), Catch::Contains("vertices[0]: joins several sheets"));
}

TEST_CASE("a count of vertices far beyond the faces is refused before it costs memory") {
  constexpr auto most = std::numeric_limits<std::int32_t>::max();
  CHECK_THROWS_WITH(Topology(most, faces({{0, 1, 3}})), Catch::Contains("vertices[2]: belongs to no face"));
}

TEST_CASE("a vertex with very many faces costs no more than as many vertices") {
  constexpr int spokes = 200000;  // minutes, when it takes the square of it
  Faces wheel(spokes, 3);
  for (int s = 0; s < spokes; ++s) wheel.row(s) << 0, s + 1, (s + 1) % spokes + 1;
  CHECK(Topology(spokes + 1, wheel).hinges().size() == spokes);
  CHECK_NOTHROW(Topology(spokes + 1, Faces(wheel.topRows(spokes - 1))));  // open, still one fan
}

TEST_CASE("faulty positions are refused with the place named") {
  const Topology topology(4, tetrahedron);
  Vertices shape(4, 3);
  shape << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1;
  CHECK_NOTHROW(requireValidShape(topology, shape, "s"));
  CHECK_THROWS_WITH(requireValidShape(topology, shape.topRows(3), "s"), Catch::Contains("s: has 3 vertices, want 4"));
  Vertices broken = shape;
  broken(2, 1) = std::nan("");
  CHECK_THROWS_WITH(requireValidShape(topology, broken, "s"), Catch::Contains("s: vertex 2"));
  broken = shape;
  broken.row(2) = 0.5 * shape.row(1);
  CHECK_THROWS_WITH(requireValidShape(topology, broken, "s"), Catch::Contains("s: face 0 is degenerate"));
}

TEST_CASE("faces know the hinges at their edges") {
  const Topology tetra(4, tetrahedron), lone(3, faces({{0, 1, 2}}));
  for (std::size_t f = 0; f < 4; ++f)
    for (std::size_t c = 0; c < 3; ++c) {
      const auto& hinge = tetra.hinges()[static_cast<std::size_t>(tetra.faceHinges()[f][c])];
      CHECK(hinge.edges[0] == tetra.faceEdges()[f][c]);
      CHECK((hinge.faces[0] == static_cast<int>(f) || hinge.faces[1] == static_cast<int>(f)));
    }
  CHECK(lone.faceHinges()[0] == std::array<std::int32_t, 3>{-1, -1, -1});
}
