#include "core/curve/joining.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <catch2/catch.hpp>

#include "core/mesh/alignment.h"
#include "tests/support/calculus.h"

using namespace shaped;
using namespace shaped::test;

namespace {

struct Fixture {
  Mesh mesh = tube(12, 6);
  ShellStructurePtr structure = std::make_shared<const ShellStructure>(mesh.topology);
  double bending = defaultBending(mesh.vertices);

  /// Bends from one angle to another, at an even pace.
  std::vector<Vertices> clip(double from, double to, int frames) const {
    std::vector<Vertices> shapes;
    for (int i = 0; i < frames; ++i) shapes.push_back(bend(mesh.vertices, from + (to - from) * i / (frames - 1)));
    return shapes;
  }
};

std::vector<Vertices> turned(std::vector<Vertices> clip, double angle, const Eigen::Vector3d& axis,
                             const Eigen::RowVector3d& shift) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
  for (auto& shape : clip) {
    shape = shape * turn.transpose();
    shape.rowwise() += shift;
  }
  return clip;
}

}  // namespace

TEST_CASE("clips that meet share the frame at the seam, wherever the second one lies") {
  const Fixture f;
  const auto first = f.clip(0, 0.5, 8);
  const auto second = turned(f.clip(0.5, 0, 8), 1.1, {1, 2, 3}, {4, -2, 1});
  const auto whole = concatenated(f.structure, f.bending, {first, second}, {});
  REQUIRE(whole.converged());
  const auto& frames = whole.solution.curve.frames;
  REQUIRE(frames.size() == 15);
  CHECK(whole.solution.seams == std::vector<std::pair<std::size_t, std::size_t>>{{7, 7}});
  for (std::size_t i = 0; i < 8; ++i) CHECK((frames[14 - i] - first[i]).cwiseAbs().maxCoeff() < 1e-9);
}

TEST_CASE("between clips that do not meet there are as many frames as keep the speed, or as asked for") {
  const Fixture f;
  const auto first = f.clip(0, 0.4, 9);     // 0.05 a frame
  const auto second = f.clip(0.7, 1.0, 7);  // 0.05 a frame
  JoinOptions options;
  const auto even = concatenated(f.structure, f.bending, {first, second}, options);
  REQUIRE(even.converged());
  CHECK(even.solution.curve.size() == 9 + 5 + 7);
  CHECK(even.solution.seams == std::vector<std::pair<std::size_t, std::size_t>>{{8, 14}});
  const auto energies = segmentEnergies(*f.mesh.topology, f.bending, even.solution.curve,
                                        measuresOf(*f.mesh.topology, even.solution.curve));
  const auto [least, most] = std::minmax_element(energies.begin(), energies.end());
  CHECK(*most < 1.6 * *least);
  options.transition = 2;
  CHECK(concatenated(f.structure, f.bending, {first, second, first}, options).solution.curve.size() ==
        9 + 2 + 7 + 2 + 9);
  options.transition = 0;
  const auto cut = concatenated(f.structure, f.bending, {first, second}, options);
  CHECK(cut.solution.seams == std::vector<std::pair<std::size_t, std::size_t>>{{8, 9}});
}

TEST_CASE("an upright seam turns a clip about the vertical alone and keeps its height") {
  const Fixture f;
  const auto first = f.clip(0, 0.3, 5);
  const Eigen::Vector3d up = Eigen::Vector3d::UnitY();
  // the second clip starts leaning: the best rigid motion would set it upright
  auto leaning = f.clip(0.3, 0.5, 5);
  const Eigen::Matrix3d lean = Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX()).toRotationMatrix();
  for (auto& shape : leaning) shape = shape * lean.transpose();
  const auto second = turned(leaning, 2.2, up, {3, 0.25, -1});
  JoinOptions options;
  options.up = 5 * up;
  options.transition = 0;
  const auto whole = concatenated(f.structure, f.bending, {first, second}, options);
  const auto& frames = whole.solution.curve.frames;
  REQUIRE(frames.size() == 10);
  const auto motion = alignRigidly(second[0], frames[5]);
  CHECK((apply(motion, second[0]) - frames[5]).cwiseAbs().maxCoeff() < 1e-9);
  CHECK((motion.rotation * up - up).norm() < 1e-9);
  CHECK(frames[5].col(1) == second[0].col(1));
  const auto turnOf = [&](double angle) {
    const RigidMotion around{Eigen::AngleAxisd(angle, up).toRotationMatrix() * motion.rotation, motion.translation};
    Vertices shape = apply(around, second[0]);
    Eigen::RowVector3d shift = first.back().colwise().mean() - shape.colwise().mean();
    shift[1] = 0;
    shape.rowwise() += shift;
    return (shape - first.back()).squaredNorm();
  };
  CHECK(turnOf(0) < turnOf(0.02));
  CHECK(turnOf(0) < turnOf(-0.02));
}

TEST_CASE("joining rounds the corner at the seam and leaves the rest alone") {
  const Fixture f;
  const auto first = f.clip(0, 0.9, 40), second = f.clip(0.9, 0, 40);
  JoinOptions options;
  options.reach = 25;
  options.smoothing.steps = 50;
  const auto result = joined(f.structure, f.bending, {first, second}, options);
  REQUIRE(result.converged());
  const auto& smooth = result.solution;
  REQUIRE(smooth.curve.size() == 79);
  CHECK(smooth.seams.front().first == 39);
  CHECK(smooth.steps == 50);
  CHECK(smooth.path_energy_after < smooth.path_energy_before);
  CHECK(smooth.gradient_after[39] < 0.1 * smooth.gradient_before[39]);
  for (std::size_t i = 0; i < 14; ++i) CHECK(smooth.curve.frames[i] == first[i]);
  CHECK(smooth.curve.frames[38] != first[38]);
}

TEST_CASE("bad input to joining is refused by name") {
  const Fixture f;
  const auto clip = f.clip(0, 0.5, 4);
  const auto refuse = [&](const std::vector<std::vector<Vertices>>& clips, const JoinOptions& options = {}) {
    return joined(f.structure, f.bending, clips, options);
  };
  CHECK_THROWS_WITH(refuse({clip}), Catch::Contains("clips"));
  CHECK_THROWS_WITH(refuse({clip, {}}), Catch::Contains("clips[1]: has no frames"));
  CHECK_THROWS_WITH(refuse({clip, {icosphere(0).vertices}}), Catch::Contains("clips[1][0]: has 12 vertices"));
  JoinOptions bad;
  bad.reach = -1;
  CHECK_THROWS_WITH(refuse({clip, clip}, bad), Catch::Contains("reach = -1"));
  bad = {};
  bad.transition = -2;
  CHECK_THROWS_WITH(refuse({clip, clip}, bad), Catch::Contains("transition = -2"));
  bad = {};
  bad.up = Eigen::Vector3d::Zero();
  CHECK_THROWS_WITH(refuse({clip, clip}, bad), Catch::Contains("up"));
  std::stop_source stop;
  stop.request_stop();
  JoinOptions stopped;
  stopped.smoothing.flow.stop = stop.get_token();
  CHECK(refuse({clip, clip}, stopped).termination == Termination::kCancelled);
}
