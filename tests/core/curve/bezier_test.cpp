#include "core/curve/bezier.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include "core/curve/travel.h"
#include "core/mesh/alignment.h"
#include "core/shell/shell_objective.h"
#include "tests/support/calculus.h"

using namespace shaped;
using namespace shaped::test;

namespace {

struct Fixture {
  Mesh mesh = tube(14, 7);
  ShellStructurePtr structure = std::make_shared<const ShellStructure>(mesh.topology);
  double bending = defaultBending(mesh.vertices);

  Vertices shape(double angle, double thickness) const {
    Vertices result = mesh.vertices;
    result.rightCols<2>() *= thickness;
    return bend(result, angle);
  }
  Solved<BezierCurve> curve(const std::vector<Vertices>& controls, const BezierOptions& options) const {
    return bezierCurve(structure, bending, controls, options);
  }
};

/// De Casteljau's algorithm at full resolution, each geodesic on its own: slow, and nothing shared with what is tested.
Vertices literalPoint(const GeodesicCalculus& calculus, std::vector<Vertices> points, double t, int steps) {
  while (points.size() > 1) {
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
      const auto path = calculus.interpolate(points[i], points[i + 1], steps, {100, 1e-9, {}});
      REQUIRE(path.converged());
      points[i] = calculus.at(path.solution, t, {100, 1e-9, {}}).solution;
    }
    points.pop_back();
  }
  return points.front();
}

}  // namespace

TEST_CASE("a Bezier curve is de Casteljau's construction with geodesics of all shapes") {
  const Fixture f;
  const std::vector<Vertices> controls{f.shape(0, 1), f.shape(0.9, 1), f.shape(0.9, 1.3), f.shape(-0.4, 1.1)};
  BezierOptions options;
  options.frames = 9;
  options.geodesic.enrichments = 6;
  options.geodesic.ghost_vertices = 1000;
  options.geodesic.tolerance = 1e-6;
  const auto curve = f.curve(controls, options);
  REQUIRE(curve.converged());
  const auto& frames = curve.solution.curve.frames;
  REQUIRE(frames.size() == 9);
  CHECK(frames.front() == controls.front());
  CHECK(frames.back() == controls.back());
  const GeodesicCalculus calculus(f.structure, {f.bending, EnergySymmetry::kSymmetric});
  const double way = rigidGap(controls[0], controls[1]);
  for (const std::size_t j : {2, 4, 7}) {
    const auto expected = literalPoint(calculus, controls, double(j) / 8, 8);
    CHECK(rigidGap(frames[j], expected) < 2e-3 * way);
  }
  CHECK(curve.solution.missing < 1e-3);
  CHECK(curve.solution.geodesics >= 3 + 3 * 7);
}

TEST_CASE("a Bezier curve of two shapes is their geodesic, of equal ones it stands still") {
  const Fixture f;
  const Vertices a = f.shape(0, 1), b = f.shape(0.8, 1.2);
  BezierOptions options;
  options.frames = options.auxiliary = 6;
  const auto line = f.curve({a, b}, options);
  REQUIRE(line.converged());
  auto plain = options.geodesic;
  plain.frames = 6;
  const auto geodesic = geodesicByFlow(f.structure, f.bending, a, b, plain);
  for (std::size_t i = 0; i < 6; ++i)
    CHECK(rigidGap(line.solution.curve.frames[i], geodesic.solution.curve.frames[i]) < 1e-3);
  const auto still = f.curve({a, a, a}, options);
  REQUIRE(still.converged());
  for (const auto& frame : still.solution.curve.frames) CHECK(rigidGap(frame, a) < 1e-7);
}

TEST_CASE("a Bezier curve leaves its first control shape towards the second") {
  // derivative at 0: (n - 1) (P_1 - P_0), along the first side
  const Fixture f;
  const std::vector<Vertices> controls{f.shape(0, 1), f.shape(0.5, 1), f.shape(0.5, 1.2)};
  BezierOptions options;
  options.frames = 33;
  options.auxiliary = 9;
  options.geodesic.enrichments = 4;
  const auto curve = f.curve(controls, options);
  REQUIRE(curve.converged());
  const Eigen::VectorXd first = flatten(curve.solution.curve.frames[1]) - flatten(controls[0]);
  auto plain = options.geodesic;
  plain.frames = 33;
  plain.enrichments = 4;
  const auto side = geodesicByFlow(f.structure, f.bending, controls[0], controls[1], plain);
  const Eigen::VectorXd along = flatten(side.solution.curve.frames[1]) - flatten(controls[0]);
  CHECK(first.norm() == Approx(2 * along.norm()).epsilon(0.06));
  CHECK(first.dot(along) / first.norm() / along.norm() > 0.99);
}

TEST_CASE("positions on a Bezier curve follow the one of the control shapes' positions") {
  const Fixture f;
  const auto place = [&](double turn, double x, double y) {
    Vertices shape = f.mesh.vertices * Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()).toRotationMatrix().transpose();
    shape.rowwise() += Eigen::RowVector3d(x, y, 0);
    return shape;
  };
  BezierOptions options;
  options.frames = 5;
  const auto curve = f.curve({place(0, 0, 0), place(0.6, 2, 0), place(1.2, 2, 4)}, options);
  REQUIRE(curve.converged());
  const auto& middle = curve.solution.curve.frames[2];
  CHECK(rigidGap(middle, f.mesh.vertices) < 1e-7);
  const Eigen::RowVector3d start = f.mesh.vertices.colwise().mean();
  const auto centre = [&](double turn, double x, double y) -> Eigen::RowVector3d {
    return place(turn, x, y).colwise().mean();
  };
  const Eigen::RowVector3d expected = 0.25 * start + 0.5 * centre(0.6, 2, 0) + 0.25 * centre(1.2, 2, 4);
  CHECK((middle.colwise().mean() - expected).norm() < 1e-9);
  CHECK(Eigen::AngleAxisd(alignRigidly(f.mesh.vertices, middle).rotation).angle() == Approx(0.6).margin(1e-7));
}

TEST_CASE("a Bezier curve says how it ended, tells its progress and refuses bad input by name") {
  const Fixture f;
  const std::vector<Vertices> controls{f.shape(0, 1), f.shape(0.5, 1), f.shape(0.5, 1.2)};
  double last = 0;
  BezierOptions options;
  options.frames = 5;
  CHECK(bezierCurve(f.structure, f.bending, controls, options, [&](const Progress& progress) {
          CHECK(progress.fraction >= last);
          last = progress.fraction;
        }).converged());
  CHECK(last > 0.8);
  std::stop_source stop;
  stop.request_stop();
  options.geodesic.stop = stop.get_token();
  CHECK(f.curve(controls, options).termination == Termination::kCancelled);
  CHECK_THROWS_WITH(f.curve({f.mesh.vertices}, {}), Catch::Contains("controls"));
  CHECK_THROWS_WITH(f.curve({f.mesh.vertices, icosphere(0).vertices}, {}), Catch::Contains("controls[1]"));
  BezierOptions bad;
  bad.frames = 1;
  CHECK_THROWS_WITH(f.curve(controls, bad), Catch::Contains("frames = 1"));
  bad = {};
  bad.auxiliary = 1;
  CHECK_THROWS_WITH(f.curve(controls, bad), Catch::Contains("auxiliary = 1"));
  bad = {};
  bad.geodesic.tolerance = 0;
  CHECK_THROWS_WITH(f.curve(controls, bad), Catch::Contains("tolerance"));
}
