#include "core/editing/handle_edit.h"

#include <catch2/catch.hpp>

#include "core/mesh/alignment.h"
#include "core/numerics/error.h"
#include "core/shell/energy.h"
#include "tests/support/submanifolds.h"

using namespace shaped;
using namespace shaped::test;

namespace {

const std::vector<std::int32_t> kHandles{0, 3, 20, 38, 41};

struct Scene {
  std::shared_ptr<const Submanifold> submanifold = tubeSubmanifold(2);
  const Topology& topology = submanifold->calculus().topology();
  Vertices wanted = moveRigidly(shapeAt(*submanifold, Eigen::Vector2d(0.5, -0.15)), 4);
  std::vector<AnchorTarget> handles = targetsOn(topology, wanted, kHandles);

  double fromMean(const Vertices& shape) const {
    return shellEnergy(topology, submanifold->pga().mean, shape, submanifold->calculus().bending());
  }
};

void requireFalling(const std::vector<double>& energies) {
  REQUIRE(!energies.empty());
  for (std::size_t i = 1; i < energies.size(); ++i) CHECK(energies[i] < energies[i - 1]);
}

}  // namespace

TEST_CASE("handles on a shape of the submanifold bring that shape back") {
  const Scene scene;
  HandleEditOptions options;
  options.tolerance = 1e-6;
  const auto edit = editByHandles(*scene.submanifold, scene.handles, options);
  REQUIRE(edit.converged());
  requireFalling(edit.solution.energies);
  CHECK(edit.solution.largest_handle_distance < 1e-6);
  const double distance = scene.fromMean(scene.wanted);
  CHECK(edit.solution.energies.back() < 1e-4 * distance);
  CHECK(shellEnergy(scene.topology, edit.solution.shape, scene.wanted, scene.submanifold->calculus().bending()) <
        1e-3 * distance);
  CHECK((edit.solution.shape - scene.wanted).rowwise().norm().maxCoeff() < 0.05);  // in place too
}

TEST_CASE("handles that no shape of the submanifold meets are met all the same, with falling energies") {
  Scene scene;
  scene.handles[2].position += Eigen::Vector3d(0.05, 0.3, -0.1);
  const auto edit = editByHandles(*scene.submanifold, scene.handles, {});
  REQUIRE(edit.converged());
  requireFalling(edit.solution.energies);
  CHECK(edit.solution.largest_handle_distance < 1e-6);
  CHECK((anchorPositions(scene.topology, scene.handles, edit.solution.shape).row(2).transpose() -
         scene.handles[2].position)
            .norm() < 1e-6);
  CHECK(edit.solution.energies.back() ==
        Approx(shellEnergy(scene.topology, edit.solution.shape, edit.solution.projection.shape,
                           scene.submanifold->calculus().bending()))
            .epsilon(1e-6));
  CHECK(edit.solution.energies.back() > 1e-3 * scene.fromMean(edit.solution.shape));  // the control: it cannot vanish
}

TEST_CASE("an edit turns with its handles") {
  const Scene scene;
  const auto still = editByHandles(*scene.submanifold, scene.handles, {});
  auto moved = scene.handles;
  const auto motion = alignRigidly(scene.wanted, moveRigidly(scene.wanted, 11));
  for (auto& handle : moved) handle.position = apply(motion, Vertices(handle.position.transpose())).transpose();
  const auto turned = editByHandles(*scene.submanifold, moved, {});
  CHECK((turned.solution.shape - apply(motion, still.solution.shape)).rowwise().norm().maxCoeff() < 1e-3);
}

TEST_CASE("an edit says truthfully how it ended") {
  const Scene scene;
  HandleEditOptions once;
  once.outer_iterations = 1;
  const auto limited = editByHandles(*scene.submanifold, scene.handles, once);
  CHECK(limited.termination == Termination::kIterationLimit);
  CHECK(limited.solution.energies.size() == 1);
  CHECK(limited.solution.largest_handle_distance < 1e-6);

  std::stop_source stop;
  stop.request_stop();
  HandleEditOptions stopped;
  stopped.submanifold.stop = stop.get_token();
  const auto cancelled = editByHandles(*scene.submanifold, scene.handles, stopped);
  CHECK(cancelled.termination == Termination::kCancelled);
  CHECK(cancelled.solution.shape.allFinite());
  CHECK(cancelled.solution.projection.shape.allFinite());
}

TEST_CASE("handles that determine no placement are refused") {
  Scene scene;
  auto two = scene.handles;
  two.resize(2);
  CHECK_THROWS_WITH(editByHandles(*scene.submanifold, two, {}), Catch::Contains("handles"));
  for (std::size_t l = 0; l < scene.handles.size(); ++l)
    scene.handles[l].position = Eigen::Vector3d::Constant(0.1 * static_cast<double>(l));
  CHECK_THROWS_AS(editByHandles(*scene.submanifold, scene.handles, {}), InvalidInput);
}
