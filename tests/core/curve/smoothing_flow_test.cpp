#include "core/curve/smoothing_flow.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>
#include <numeric>

#include "core/mesh/alignment.h"
#include "tests/support/calculus.h"
#include "tests/support/finite_differences.h"

using namespace shaped;
using namespace shaped::test;

namespace {

const Mesh& pipe() {
  static const Mesh mesh = tube(10, 6);
  return mesh;
}
const ShellStructurePtr& structure() {
  static const auto made = std::make_shared<const ShellStructure>(pipe().topology);
  return made;
}
PairEnergy symmetric() { return {defaultBending(pipe().vertices), EnergySymmetry::kSymmetric}; }

/// A tube that bends up and down again in even steps, with noise in shape and place.
Curve noisyCurve(int frames, bool closed, double noise) {
  Curve curve{{}, closed};
  for (int i = 0; i < frames; ++i) {
    const double phase = 3.14159265358979 * i / (closed ? 0.5 * frames : frames - 1.0);
    Vertices shape = jitter(bend(pipe().vertices, 0.8 * std::sin(phase)), noise, static_cast<unsigned>(i) + 1);
    shape.col(0).array() += 0.2 * std::sin(phase) + (i % 3 - 1) * noise;
    curve.frames.push_back(std::move(shape));
  }
  return curve;
}

Curve straight(const std::vector<double>& angles) {
  Curve curve{{}, false};
  for (const double angle : angles) curve.frames.push_back(bend(pipe().vertices, angle));
  return curve;
}

std::vector<SmoothingStep> run(SmoothingFlow& flow, int steps) {
  std::vector<SmoothingStep> taken;
  for (int k = 0; k < steps; ++k) {
    const auto step = flow.step();
    if (step.termination == Termination::kStalled) break;
    REQUIRE(step.converged());
    taken.push_back(step.solution);
  }
  return taken;
}

std::vector<double> lengths(const Curve& curve) {
  std::vector<double> result;
  for (const double energy :
       segmentEnergies(*pipe().topology, symmetric().bending(), curve, measuresOf(*pipe().topology, curve)))
    result.push_back(std::sqrt(energy));
  return result;
}

double largest(const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); }

double largestGap(const Curve& a, const Curve& b) {
  double gap = 0;
  for (std::size_t i = 0; i < a.size(); ++i) gap = std::max(gap, rigidGap(a.frames[i], b.frames[i]));
  return gap;
}

}  // namespace

TEST_CASE("the path energy falls in every step of the flow, and the ends of an open curve stay") {
  for (const bool closed : {false, true})
    for (const double tau : {0.4, 1.0}) {
      const auto curve = noisyCurve(9, closed, 0.02);
      SmoothingFlow flow(structure(), symmetric(), curve, {.tau = tau});
      double last = flow.pathEnergy();
      const auto steps = run(flow, 12);
      REQUIRE(steps.size() == 12);
      for (const auto& step : steps) {
        CHECK(step.path_energy < last);
        CHECK(step.after < step.before);
        last = step.path_energy;
      }
      if (closed) continue;
      CHECK(flow.curve().frames.front() == curve.frames.front());
      CHECK(flow.curve().frames.back() == curve.frames.back());
    }
}

TEST_CASE("gradient norms are those of the path energy's differences in each frame") {
  for (const bool closed : {false, true}) {
    auto curve = noisyCurve(4, closed, 0.02);
    const auto& topology = *pipe().topology;
    const auto norms = gradientNorms(topology, symmetric().bending(), curve, measuresOf(topology, curve));
    for (std::size_t i = 0; i < 4; ++i) {
      if (!closed && (i == 0 || i == 3)) {
        CHECK(norms[i] == 0);
        continue;
      }
      const auto energy = [&, other = curve](const Vertices& frame) mutable {
        other.frames[i] = frame;
        const auto all = segmentEnergies(topology, symmetric().bending(), other, measuresOf(topology, other));
        return std::accumulate(all.begin(), all.end(), 0.0);
      };
      CHECK(norms[i] == Approx(differenceGradient(energy, curve.frames[i], 1e-4).norm()).epsilon(1e-6));
    }
  }
}

TEST_CASE("an open curve flows to the discrete geodesic between its ends") {
  Curve curve = straight({0, 0.1, 0.9, 1.0});
  curve.frames[1] = jitter(curve.frames[1], 0.02, 7);
  SmoothingFlow flow(structure(), symmetric(), curve, {.tau = 1});
  const double corner = largest(flow.gradientNorms());
  run(flow, 60);
  const GeodesicCalculus calculus(structure(), symmetric());
  const auto geodesic = calculus.interpolate(curve.frames.front(), curve.frames.back(), 3, {100, 1e-10, {}});
  REQUIRE(geodesic.converged());
  CHECK(largestGap(flow.curve(), {geodesic.solution, false}) < 1e-6);
  CHECK(largest(flow.gradientNorms()) < 1e-5 * corner);
  CHECK(flow.pathEnergy() == Approx(2 * calculus.pathEnergy(geodesic.solution) / 3).epsilon(1e-9));
}

TEST_CASE("a closed curve contracts to one shape") {
  SmoothingFlow flow(structure(), symmetric(), noisyCurve(6, true, 0.01), {.tau = 0.6});
  const double before = flow.pathEnergy();
  run(flow, 25);
  CHECK(flow.pathEnergy() < 1e-6 * before);
  for (const auto& frame : flow.curve().frames) CHECK(rigidGap(frame, flow.curve().frames.front()) < 1e-3);
}

TEST_CASE("with a restoring force the flow's limit does not depend on the length of its steps") {
  const auto curve = noisyCurve(6, false, 0.02);
  SmoothingFlow without(structure(), symmetric(), curve, {});
  run(without, 80);
  // by distance, stiff deformations are hardly pulled and settle no faster than without
  for (const auto& [scale, most] : {std::pair{0.0, 80}, std::pair{0.5, 600}}) {
    std::vector<Curve> limits;
    // rho / ((1 - rho) tau) is the same
    for (const auto& [tau, rho] : {std::pair{0.5, 0.2}, std::pair{0.25, 1.0 / 9}}) {
      SmoothingFlow flow(structure(), symmetric(), curve,
                         {.tau = tau, .restore = std::vector<double>(6, rho), .restore_scale = scale});
      const auto steps = run(flow, most);
      for (const auto& step : steps) CHECK(step.after < step.before);
      limits.push_back(flow.curve());
    }
    CHECK(largestGap(limits[0], limits[1]) < 1e-6);
    CHECK(largestGap(limits[0], curve) < 0.6 * largestGap(without.curve(), curve));
  }
}

TEST_CASE("pulled by distances, frames lose fine noise and keep coarse motion") {
  const auto noisy = noisyCurve(16, false, 0.02), clean = noisyCurve(16, false, 0);
  const auto error = [&](const Curve& curve) {
    double squares = 0;
    for (std::size_t i = 1; i + 1 < clean.size(); ++i)
      squares +=
          (apply(alignRigidly(curve.frames[i], clean.frames[i]), curve.frames[i]) - clean.frames[i]).squaredNorm();
    return std::sqrt(squares);
  };
  const auto smoothed = [&](double rho, double scale) {
    SmoothingFlow flow(structure(), symmetric(), noisy,
                       {.restore = std::vector<double>(16, rho), .restore_scale = scale});
    run(flow, 40);
    return std::pair(error(flow.curve()), flow.pathEnergy());
  };
  const auto [by_distance, energy] = smoothed(0.3, 0.4);
  CHECK(by_distance < 0.75 * error(noisy));
  // by energy, whatever the strength: worse, or not as smooth
  for (const double rho : {0.003, 0.01, 0.03, 0.1, 0.3}) {
    const auto [by_energy, other] = smoothed(rho, 0);
    CHECK((by_energy > 1.2 * by_distance || other > 1.2 * energy));
  }
}

TEST_CASE("held frames and those restored with full strength do not move") {
  const auto curve = noisyCurve(7, false, 0.02);
  SmoothingFlowOptions options;
  options.held.assign(7, false);
  options.held[2] = true;
  options.restore.assign(7, 0.1);
  options.restore[4] = 1;
  SmoothingFlow flow(structure(), symmetric(), curve, options);
  run(flow, 5);
  for (std::size_t i = 0; i < 7; ++i)
    CHECK((flow.curve().frames[i] == curve.frames[i]) == (i == 0 || i == 2 || i == 4 || i == 6));
}

TEST_CASE("segments of a geodesic become equally long, or keep their ratios when asked") {
  const GeodesicCalculus calculus(structure(), symmetric());
  const auto fine = calculus.interpolate(bend(pipe().vertices, 0), bend(pipe().vertices, 0.9), 12, {100, 1e-10, {}});
  REQUIRE(fine.converged());
  Curve uneven{{}, false};
  for (const std::size_t k : {0, 1, 4, 6, 12}) uneven.frames.push_back(fine.solution[k]);
  const auto ratios = [](const Curve& curve) {
    auto result = lengths(curve);
    const double sum = std::accumulate(result.begin(), result.end(), 0.0);
    for (auto& length : result) length /= sum;
    return result;
  };
  const auto before = ratios(uneven);
  SmoothingFlow equal(structure(), symmetric(), uneven, {.tau = 0.9});
  run(equal, 40);
  for (const double ratio : ratios(equal.curve())) CHECK(ratio == Approx(0.25).epsilon(0.02));
  SmoothingFlow keeping(structure(), symmetric(), uneven, {.tau = 0.9, .keep_speed = true});
  run(keeping, 40);
  const auto after = ratios(keeping.curve());
  for (std::size_t k = 0; k < before.size(); ++k) CHECK(after[k] == Approx(before[k]).epsilon(0.02));
  const auto sum = [](const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); };
  CHECK(sum(lengths(keeping.curve())) <= sum(lengths(uneven)) * (1 + 1e-12));
}

TEST_CASE("a corner is smoothed at kept speed too: no step makes the curve longer") {
  SmoothingFlow flow(structure(), symmetric(), noisyCurve(8, false, 0.02), {.tau = 0.7, .keep_speed = true});
  double last = 1e300;
  for (int k = 0; k < 10; ++k) {
    const auto now = lengths(flow.curve());
    const double length = std::accumulate(now.begin(), now.end(), 0.0);
    CHECK(length < last);
    last = length;
    REQUIRE(flow.step().converged());
  }
}

TEST_CASE("frames that move evenly through space stay, and trembling places are smoothed") {
  Curve even{{}, false}, trembling{{}, false};
  for (int i = 0; i < 7; ++i) {
    Vertices shape = bend(pipe().vertices, 0.1);
    shape.col(0).array() += 0.3 * i;
    even.frames.push_back(shape);
    shape.col(2).array() += i % 2 == 1 ? 0.05 : 0;
    trembling.frames.push_back(shape);
  }
  SmoothingFlow still(structure(), symmetric(), even, {});
  CHECK(still.step().solution.stationary);
  for (std::size_t i = 0; i < 7; ++i) CHECK((still.curve().frames[i] - even.frames[i]).norm() < 1e-6);
  SmoothingFlow flow(structure(), symmetric(), trembling, {});
  CHECK(run(flow, 5).size() == 5);
  for (std::size_t i = 1; i < 6; ++i) {
    const auto height = [](const Vertices& shape) { return shape.col(2).mean(); };
    const auto& frames = flow.curve().frames;
    CHECK(std::abs(height(frames[i]) - height(frames[i - 1])) < 0.6 * 0.05);
  }
}

TEST_CASE("one-sided averages smooth nearly as symmetric ones do") {
  const auto curve = noisyCurve(7, false, 0.01);
  std::vector<Curve> results;
  for (const auto symmetry : {EnergySymmetry::kSymmetric, EnergySymmetry::kDirected}) {
    SmoothingFlow flow(structure(), {symmetric().bending(), symmetry}, curve, {});
    run(flow, 10);
    results.push_back(flow.curve());
  }
  CHECK(largestGap(results[0], results[1]) < 0.05 * largestGap(results[0], curve));
  CHECK(largestGap(results[0], results[1]) > 0);
}

TEST_CASE("a stopped step leaves the curve as it was") {
  const auto curve = noisyCurve(5, false, 0.02);
  std::stop_source stop;
  SmoothingFlow flow(structure(), symmetric(), curve, {.stop = stop.get_token()});
  stop.request_stop();
  CHECK(flow.step().termination == Termination::kCancelled);
  for (std::size_t i = 0; i < curve.size(); ++i) CHECK(flow.curve().frames[i] == curve.frames[i]);
}

TEST_CASE("equal frames are a stationary curve") {
  SmoothingFlow flow(structure(), symmetric(), straight({0.3, 0.3, 0.3, 0.3}), {});
  CHECK(std::abs(flow.pathEnergy()) < 1e-14);
  CHECK(flow.step().termination == Termination::kStalled);
  CHECK(std::abs(flow.pathEnergy()) < 1e-14);
}

TEST_CASE("the flow refuses by name what is no curve, and options out of range") {
  const auto curve = noisyCurve(5, false, 0.02);
  const auto make = [](const Curve& of, const SmoothingFlowOptions& options) {
    return SmoothingFlow(structure(), symmetric(), of, options);
  };
  auto bad = curve;
  bad.frames.resize(1);
  CHECK_THROWS_WITH(make(bad, {}), Catch::Contains("frames: has 1 frames, an open curve needs at least 2"));
  bad = {{curve.frames[0], curve.frames[1]}, true};
  CHECK_THROWS_WITH(make(bad, {}), Catch::Contains("a closed curve needs at least 3"));
  bad = curve;
  bad.frames[3](7, 1) = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(make(bad, {}), Catch::Contains("frames[3]: vertex 7"));
  bad = curve;
  bad.frames[2] = icosphere(0).vertices;
  CHECK_THROWS_WITH(make(bad, {}), Catch::Contains("frames[2]: has 12 vertices"));
  bad.frames[0] = icosphere(0).vertices;
  CHECK_THROWS_WITH(make(bad, {.restore_scale = 0.1}), Catch::Contains("frames[0]: has 12 vertices"));
  for (const double tau : {0.0, -1.0, 1.1, std::numeric_limits<double>::quiet_NaN()})
    CHECK_THROWS_WITH(make(curve, {.tau = tau}), Catch::Contains("tau"));
  CHECK_THROWS_WITH(make(curve, {.restore = {0, 0, 1.5, 0, 0}}), Catch::Contains("restore[2]"));
  CHECK_THROWS_WITH(make(curve, {.restore = {0.1}}), Catch::Contains("restore has 1 entries"));
  for (const double scale : {-0.1, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()})
    CHECK_THROWS_WITH(make(curve, {.restore_scale = scale}), Catch::Contains("restore_scale"));
  CHECK_THROWS_WITH(make(curve, {.held = {true}}), Catch::Contains("held has 1 entries"));
}
