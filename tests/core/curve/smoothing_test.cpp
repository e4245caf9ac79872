#include "core/curve/smoothing.h"

#include <catch2/catch.hpp>
#include <limits>

#include "core/curve/long_clip.h"
#include "core/mesh/quality.h"
#include "tests/support/calculus.h"

using namespace shaped;
using namespace shaped::test;

namespace {

struct Fixture {
  Mesh mesh = tube(12, 6);
  ShellStructurePtr structure = std::make_shared<const ShellStructure>(mesh.topology);
  double bending = defaultBending(mesh.vertices);

  /// Bends to and fro, trembling.
  Curve clip(int frames) const {
    Curve curve{{}, false};
    for (int i = 0; i < frames; ++i) {
      Vertices shape = bend(mesh.vertices, 0.7 * std::sin(0.2 * i) + (i % 2 == 1 ? 0.05 : 0));
      shape.col(0).array() += 0.02 * i;
      curve.frames.push_back(shape);
    }
    return curve;
  }
};

double largestGap(const std::vector<Vertices>& a, const std::vector<Vertices>& b) {
  double gap = 0;
  for (std::size_t i = 0; i < a.size(); ++i) gap = std::max(gap, (a[i] - b[i]).cwiseAbs().maxCoeff());
  return gap;
}

}  // namespace

TEST_CASE("smoothing reports each step and the gradient before and after, reduced and not") {
  const Fixture f;
  const auto clip = f.clip(24);
  for (const bool reduced : {true, false}) {
    SmoothingOptions options;
    options.steps = 6;
    options.reduced = reduced;
    double told = 0;
    const auto result =
        smoothed(f.structure, f.bending, clip, options, [&](const Progress& progress) { told = progress.fraction; });
    REQUIRE(result.converged());
    CHECK(told == 1);
    const auto& smooth = result.solution;
    REQUIRE(smooth.steps.size() == 6);
    CHECK_FALSE(smooth.stationary);
    CHECK(smooth.path_energy_after < 0.8 * smooth.path_energy_before);
    double last = smooth.path_energy_before * 1.001;
    for (const auto& step : smooth.steps) {
      CHECK(step.path_energy < last);
      last = step.path_energy;
    }
    CHECK(smooth.gradient_before ==
          gradientNorms(*f.mesh.topology, f.bending, clip, measuresOf(*f.mesh.topology, clip)));
    for (std::size_t i = 1; i < 23; ++i) CHECK(smooth.gradient_after[i] < smooth.gradient_before[i]);
    CHECK(smooth.curve.frames.front() == clip.frames.front());
    CHECK(smooth.curve.frames.back() == clip.frames.back());
  }
}

TEST_CASE("smoothing without steps and of a still clip changes nothing") {
  const Fixture f;
  SmoothingOptions none;
  none.steps = 0;
  const auto clip = f.clip(5);
  const auto same = smoothed(f.structure, f.bending, clip, none);
  CHECK(same.converged());
  CHECK(largestGap(same.solution.curve.frames, clip.frames) == 0);
  const Curve still{std::vector<Vertices>(4, f.mesh.vertices), false};
  for (const bool reduced : {true, false}) {
    SmoothingOptions options;
    options.reduced = reduced;
    const auto result = smoothed(f.structure, f.bending, still, options);
    CHECK(result.converged());
    CHECK(result.solution.stationary);
    CHECK(largestGap(result.solution.curve.frames, still.frames) < 1e-9);
  }
}

TEST_CASE("smoothing leaves held frames as they are and stops where it is told to") {
  const Fixture f;
  const auto clip = f.clip(24);
  SmoothingOptions options;
  options.flow.held.assign(24, false);
  options.flow.held[7] = options.flow.held[8] = true;
  const auto held = smoothed(f.structure, f.bending, clip, options);
  REQUIRE(held.converged());
  CHECK(held.solution.curve.frames[7] == clip.frames[7]);
  CHECK(held.solution.curve.frames[8] == clip.frames[8]);
  CHECK(held.solution.curve.frames[9] != clip.frames[9]);
  std::stop_source stop;
  stop.request_stop();
  options.flow.stop = stop.get_token();
  CHECK(smoothed(f.structure, f.bending, clip, options).termination == Termination::kCancelled);
}

TEST_CASE("bad input to smoothing is refused by name") {
  const Fixture f;
  auto clip = f.clip(5);
  const auto refuse = [&](const SmoothingOptions& options) { return smoothed(f.structure, f.bending, clip, options); };
  SmoothingOptions bad;
  bad.steps = -1;
  CHECK_THROWS_WITH(refuse(bad), Catch::Contains("steps = -1"));
  bad = {};
  bad.flow.tau = 0;
  CHECK_THROWS_WITH(refuse(bad), Catch::Contains("tau"));
  bad.flow.tau = 1.01;
  CHECK_THROWS_WITH(refuse(bad), Catch::Contains("tau"));
  bad = {};
  bad.flow.restore.assign(5, 1.5);
  CHECK_THROWS_WITH(refuse(bad), Catch::Contains("restore[0]"));
  bad = {};
  bad.reduction.dimension = 0;
  CHECK_THROWS_WITH(refuse(bad), Catch::Contains("dimension = 0"));
  bad = {};
  bad.reduction.ghost_vertices = 3;
  CHECK_THROWS_WITH(refuse(bad), Catch::Contains("ghost_vertices = 3"));
  bad = {};
  bad.reduction.ghost_vertices = 100000;  // larger than the mesh: its own ghost
  CHECK(refuse(bad).converged());
  clip.frames[3](2, 1) = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(refuse({}), Catch::Contains("frames[3]: vertex 2"));
  clip.frames[3] = icosphere(0).vertices;
  CHECK_THROWS_WITH(refuse({}), Catch::Contains("frames[3]: has 12 vertices"));
  clip.frames.resize(1);
  CHECK_THROWS_WITH(refuse({}), Catch::Contains("1 frames"));
}

TEST_CASE("a mesh with a boundary is smoothed, one of several components refused") {
  const auto sheet = grid(6);
  Curve curve{{}, false};
  for (int i = 0; i < 7; ++i) curve.frames.push_back(curl(sheet.vertices, 0.2 * i + (i % 2 == 1 ? 0.1 : 0)));
  const auto structure = std::make_shared<const ShellStructure>(sheet.topology);
  CHECK(smoothed(structure, defaultBending(sheet.vertices), curve, {}).converged());
  Faces faces(4, 3);
  faces << 0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7;
  Vertices two(8, 3);
  two << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1;
  const auto pieces = std::make_shared<const Topology>(8, faces);
  CHECK_THROWS_WITH(
      smoothed(std::make_shared<const ShellStructure>(pieces), 1e-3, {std::vector<Vertices>(3, two), false}, {}),
      Catch::Contains("component"));
}

TEST_CASE("a frame turned inside out is smoothed like any other and does not spread") {
  const Fixture f;
  auto clip = f.clip(9);
  clip.frames[4].col(2) *= -1;  // a mirror image has the same lengths but all angles the other way
  SmoothingOptions options;
  options.reduced = false;
  options.steps = 3;
  const auto result = smoothed(f.structure, f.bending, clip, options);
  for (const auto& frame : result.solution.curve.frames) CHECK(frame.allFinite());
  CHECK(result.solution.path_energy_after <= result.solution.path_energy_before);
}

TEST_CASE("what the flow reaches grows with the root of its steps") {
  CHECK(flowReach(1, 0.5) == 1);
  CHECK(flowReach(50, 0.5) == 20);
  CHECK(flowReach(200, 0.5) == 40);
  CHECK(flowReach(0, 0.5) == 0);
}

TEST_CASE("a long clip comes out of its windows as it comes out of one") {
  const Fixture f;
  const auto clip = f.clip(60);
  const FrameSource source{60, [&](std::int64_t i) { return clip.frames[std::size_t(i)]; }};
  for (const bool reduced : {false, true}) {
    LongClipOptions options;
    options.smoothing.steps = 8;
    options.smoothing.reduced = reduced;
    options.smoothing.flow.control = false;
    options.window = 30;
    std::vector<Vertices> frames;
    const auto sink = [&](std::int64_t index, const Vertices& frame) {
      CHECK(index == std::int64_t(frames.size()));
      frames.push_back(frame);
    };
    const auto result = smoothLongClip(f.structure, f.bending, source, options, sink);
    REQUIRE(result.converged());
    REQUIRE(frames.size() == 60);
    CHECK(result.solution.windows == 6);
    CHECK(result.solution.steps == 8);
    const auto whole = smoothed(f.structure, f.bending, clip, options.smoothing);
    // at full resolution nothing beyond `steps` frames matters, and windows see as far
    CHECK(largestGap(frames, whole.solution.curve.frames) < (reduced ? 5e-3 : 1e-5));
    CHECK(result.solution.path_energy_before == Approx(whole.solution.path_energy_before));
    CHECK(result.solution.path_energy_after == Approx(whole.solution.path_energy_after).epsilon(reduced ? 0.02 : 1e-4));
  }
}

TEST_CASE("a long clip takes each frame's restoring force and mask along and names bad frames by their place") {
  const Fixture f;
  auto clip = f.clip(40);
  const FrameSource source{40, [&](std::int64_t i) { return clip.frames[std::size_t(i)]; }};
  LongClipOptions options;
  options.window = 16;
  options.smoothing.steps = 3;
  options.smoothing.flow.held.assign(40, false);
  options.smoothing.flow.held[21] = true;
  options.smoothing.flow.restore.assign(40, 0);
  options.smoothing.flow.restore[33] = 1;
  std::vector<Vertices> frames;
  const auto keep = [&](std::int64_t, const Vertices& frame) { frames.push_back(frame); };
  REQUIRE(smoothLongClip(f.structure, f.bending, source, options, keep).converged());
  CHECK((frames[21] - clip.frames[21]).cwiseAbs().maxCoeff() < 1e-12);
  CHECK((frames[33] - clip.frames[33]).cwiseAbs().maxCoeff() < 1e-12);
  CHECK(frames[22] != clip.frames[22]);
  clip.frames[31](0, 0) = std::numeric_limits<double>::infinity();
  CHECK_THROWS_WITH(smoothLongClip(f.structure, f.bending, source, options, keep), Catch::Contains("frames[31]"));
  options.window = 3;
  CHECK_THROWS_WITH(smoothLongClip(f.structure, f.bending, source, options, keep), Catch::Contains("window = 3"));
}
