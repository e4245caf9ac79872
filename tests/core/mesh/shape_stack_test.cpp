#include "core/mesh/shape_stack.h"

#include <catch2/catch.hpp>
#include <limits>

#include "core/numerics/error.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;

namespace {

/// What a check says; empty: nothing.
std::string complaint(const std::function<void()>& check) {
  try {
    check();
    return "";
  } catch (const InvalidInput& problem) {
    return problem.what();
  }
}

/// A flat triangle of base 1 and area `share` of its longest edge squared, hung onto an icosphere's vertex positions.
Vertices withThinFace(const Topology& topology, Vertices shape, double share) {
  const auto face = topology.faces().row(5);
  shape.row(face[0]) = Eigen::RowVector3d(0, 0, 0);
  shape.row(face[1]) = Eigen::RowVector3d(1, 0, 0);
  shape.row(face[2]) = Eigen::RowVector3d(0.5, 2 * share, 0);
  return shape;
}

}  // namespace

TEST_CASE("a stack holds copies of shapes, or shares memory and keeps its owner alive") {
  const auto sphere = icosphere(1);
  const std::vector<Vertices> shapes{sphere.vertices, 2 * sphere.vertices, -sphere.vertices};
  const ShapeStack copied(shapes);
  REQUIRE(copied.size() == 3);
  for (std::size_t i = 0; i < 3; ++i) CHECK(copied[i] == shapes[i]);
  CHECK(copied.bytes() == 3 * sizeof(double) * static_cast<std::size_t>(sphere.vertices.size()));
  CHECK(copied.shapes() == shapes);

  auto owner = std::make_shared<Vertices>(copied.stacked());
  const std::weak_ptr<Vertices> watched = owner;
  auto shared = std::make_unique<ShapeStack>(owner, owner->data(), 3, sphere.vertices.rows(), 12345);
  CHECK((*shared)[1].data() == owner->row(sphere.vertices.rows()).data());
  CHECK(shared->bytes() == 12345);
  owner.reset();
  auto copy = std::make_unique<ShapeStack>(*shared);
  shared.reset();
  CHECK(*copy == copied);
  copy.reset();
  CHECK(watched.expired());

  CHECK(ShapeStack().empty());
  CHECK(ShapeStack() == ShapeStack(std::vector<Vertices>()));
  CHECK_FALSE(ShapeStack({shapes[0]}) == ShapeStack({shapes[1]}));
  CHECK_THROWS_WITH(ShapeStack({shapes[0], Vertices::Zero(5, 3)}), Catch::Contains("shapes[1]: has 5 vertices"));
}

TEST_CASE("a stack is valid exactly where each of its shapes is, and the error is the same") {
  const auto sphere = icosphere(1);
  const auto& topology = *sphere.topology;
  const auto agree = [&](const Vertices& shape, bool valid) {
    const auto alone = complaint([&] { requireValidShape(topology, shape, "s[1]"); });
    const auto stacked = complaint([&] { requireValidShapes(topology, ShapeStack({sphere.vertices, shape}), "s"); });
    CHECK(alone == stacked);
    CHECK(alone.empty() == valid);
  };
  agree(sphere.vertices, true);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                           -std::numeric_limits<double>::infinity()})
    for (const Eigen::Index v : {Eigen::Index{0}, Eigen::Index{11}, sphere.vertices.rows() - 1})
      for (const Eigen::Index axis : {0, 1, 2}) {
        auto shape = sphere.vertices;
        shape(v, axis) = bad;
        agree(shape, false);
      }
  // around both thresholds, the exact one and the one of the fast pass
  for (const double share : {1e-14, 0.9e-12, 1.1e-12, 0.9e-11, 1.1e-11, 1e-9})
    agree(withThinFace(topology, sphere.vertices, share), share > 1e-12);
  agree(withThinFace(topology, sphere.vertices, 0), false);
  // squares of squares that leave the range of numbers: the fast pass cannot tell, and asks
  for (const double scale : {1e-100, 1e-70, 1e70, 1e100}) {
    const Vertices shape = scale * sphere.vertices;
    agree(shape, complaint([&] { requireValidShape(topology, shape, "s[1]"); }).empty());
  }
  CHECK_THROWS_WITH(requireValidShapes(topology, ShapeStack({Vertices(sphere.vertices.topRows(20))}), "s"),
                    Catch::Contains("s[0]: has 20 vertices, want 42"));
}
