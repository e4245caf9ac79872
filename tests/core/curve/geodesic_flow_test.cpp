#include "core/curve/geodesic_flow.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "tests/support/calculus.h"

using namespace shaped;
using namespace shaped::test;

namespace {

struct Fixture {
  Mesh mesh = tube(16, 8);
  ShellStructurePtr structure = std::make_shared<const ShellStructure>(mesh.topology);
  double bending = defaultBending(mesh.vertices);
  Vertices a = mesh.vertices, b = moveRigidly(bend(mesh.vertices, 0.8), 3);

  Solved<GeodesicFlow> flow(const GeodesicFlowOptions& options) const {
    return geodesicByFlow(structure, bending, a, b, options);
  }
};

}  // namespace

TEST_CASE("a geodesic by flow is nearly as short as the one of all shapes, and near it") {
  const Fixture f;
  const GeodesicCalculus calculus(f.structure, {f.bending, EnergySymmetry::kSymmetric});
  const auto exact = calculus.interpolate(f.a, f.b, 8, {100, 1e-9, {}});
  REQUIRE(exact.converged());
  const auto flow = f.flow({.frames = 9, .dimension = 30});
  REQUIRE(flow.converged());
  const auto& frames = flow.solution.curve.frames;
  REQUIRE(frames.size() == 9);
  CHECK(frames.front() == f.a);
  CHECK(frames.back() == f.b);
  const double shortest = 2 * calculus.pathEnergy(exact.solution) / 8;  // (4) has neither the K nor the half
  CHECK(flow.solution.path_energy >= shortest * (1 - 1e-9));
  CHECK(flow.solution.path_energy < 1.01 * shortest);
  for (std::size_t i = 1; i < 8; ++i) CHECK(rigidGap(frames[i], exact.solution[i]) < 0.02);
}

TEST_CASE("a geodesic by flow has as many frames as asked for, at even speed, whatever is inserted at once") {
  const Fixture f;
  for (const auto& [frames, insert] : {std::pair{2, 3}, std::pair{3, 1}, std::pair{12, 2}, std::pair{20, 3}}) {
    const auto flow = f.flow({.frames = frames, .insert = insert, .ghost_vertices = 80});
    REQUIRE(flow.converged());
    const auto& curve = flow.solution.curve;
    REQUIRE(static_cast<int>(curve.size()) == frames);
    const auto energies = segmentEnergies(*f.mesh.topology, f.bending, curve, measuresOf(*f.mesh.topology, curve));
    const auto [least, most] = std::minmax_element(energies.begin(), energies.end());
    CHECK(*most < 1.5 * *least);
    for (const auto& frame : curve.frames) CHECK(smallestAreaRatio(f.mesh.topology->faces(), f.a, frame) > 0.5);
  }
}

TEST_CASE("the frames of a geodesic by flow travel evenly from the first position to the last") {
  Fixture f;
  f.b = f.a;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.2, Eigen::Vector3d(1, 2, 2).normalized()).toRotationMatrix();
  f.b = f.a * turn.transpose();
  f.b.rowwise() += Eigen::RowVector3d(3, 0, 1);
  const auto flow = f.flow({.frames = 5});
  REQUIRE(flow.converged());
  for (std::size_t i = 0; i < 5; ++i) {
    const auto& frame = flow.solution.curve.frames[i];
    const double share = static_cast<double>(i) / 4;
    CHECK(rigidGap(frame, f.a) < 1e-9);
    const Eigen::AngleAxisd turned(alignRigidly(f.a, frame).rotation);
    CHECK(turned.angle() == Approx(1.2 * share).margin(1e-7));
    const Eigen::RowVector3d centre = (1 - share) * f.a.colwise().mean() + share * f.b.colwise().mean();
    CHECK((frame.colwise().mean() - centre).norm() < 1e-9);
  }
}

TEST_CASE("the frames of a geodesic by flow go from one position to the next without a jump") {
  const Fixture f;
  const auto flow = f.flow({.frames = 33, .enrichments = 4});
  REQUIRE(flow.converged());
  const auto& frames = flow.solution.curve.frames;
  const double way = (f.b - f.a).norm();
  std::vector<double> steps;
  for (std::size_t i = 0; i + 1 < frames.size(); ++i) steps.push_back((frames[i + 1] - frames[i]).norm());
  const auto [least, most] = std::minmax_element(steps.begin(), steps.end());
  CHECK(*most < 0.1 * way);
  CHECK(*most < 1.7 * *least);
}

TEST_CASE("a geodesic by flow says how it ended and refuses bad input by name") {
  Fixture f;
  CHECK(f.flow({.frames = 30, .ghost_vertices = 80, .tolerance = 1e-9, .steps = 1}).termination ==
        Termination::kIterationLimit);
  std::stop_source stop;
  stop.request_stop();
  CHECK(f.flow({.stop = stop.get_token()}).termination == Termination::kCancelled);
  CHECK_THROWS_WITH(f.flow({.frames = 1}), Catch::Contains("frames = 1"));
  CHECK_THROWS_WITH(f.flow({.insert = 0}), Catch::Contains("insert = 0"));
  CHECK_THROWS_WITH(f.flow({.dimension = 0}), Catch::Contains("dimension = 0"));
  CHECK_THROWS_WITH(f.flow({.ghost_vertices = 2}), Catch::Contains("ghost_vertices = 2"));
  CHECK_THROWS_WITH(f.flow({.tolerance = 0}), Catch::Contains("tolerance"));
  f.b(3, 1) = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(f.flow({}), Catch::Contains("b: vertex 3"));
  f.b = icosphere(0).vertices;
  CHECK_THROWS_WITH(f.flow({}), Catch::Contains("b: has 12 vertices"));
}
