#include "tests/support/submanifolds.h"

#include <catch2/catch.hpp>
#include <map>

namespace shaped::test {

std::shared_ptr<const Submanifold> tubeSubmanifold(int modes) {
  static std::map<int, std::shared_ptr<const Submanifold>> kept;
  auto& submanifold = kept[modes];
  if (!submanifold) {
    const auto set = variedTubes();
    auto pga = principalVariations(*set.calculus, set.spider(2), modes, {});
    REQUIRE(pga.converged());
    submanifold =
        std::make_shared<const Submanifold>(set.calculus, std::make_shared<const ShellPga>(std::move(pga.solution)));
  }
  return submanifold;
}

Vertices shapeAt(const Submanifold& submanifold, const Eigen::VectorXd& coordinates) {
  const auto solved = submanifold.shapeOf(submanifold.pointOf(coordinates), {});
  REQUIRE(solved.converged());
  return solved.solution.shape;
}

Anchor anchorAt(const Topology& topology, std::int32_t vertex) {
  const auto& faces = topology.faces();
  for (Eigen::Index f = 0; f < faces.rows(); ++f)
    for (int c = 0; c < 3; ++c)
      if (faces(f, c) == vertex)
        return {static_cast<std::int32_t>(f), Eigen::Vector3d::Unit(c), Eigen::Vector3d::Zero()};
  FAIL("vertex " << vertex << " has no face");
  return {};
}

std::vector<AnchorTarget> targetsOn(const Topology& topology, const Vertices& shape,
                                    const std::vector<std::int32_t>& vertices) {
  std::vector<AnchorTarget> targets;
  for (const auto vertex : vertices) targets.push_back({anchorAt(topology, vertex), shape.row(vertex).transpose(), 1});
  return targets;
}

}  // namespace shaped::test
