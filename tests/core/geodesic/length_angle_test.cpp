#include "core/geodesic/length_angle.h"

#include <catch2/catch.hpp>

#include "core/shell/energy.h"
#include "tests/support/calculus.h"

using namespace shaped;
using namespace shaped::test;

namespace {

/// How closely a shape has the wanted lengths and angles.
double measureError(const Topology& topology, const Vertices& shape, const ShellMeasures& wanted) {
  const auto found = measure(topology, shape);
  double worst = (found.squared_length.cwiseQuotient(wanted.squared_length).array() - 1).abs().maxCoeff();
  for (Eigen::Index h = 0; h < found.angle.size(); ++h)
    worst = std::max(worst, std::abs(std::remainder(found.angle[h] - wanted.angle[h], 2 * 3.14159265358979323846)));
  return worst;
}

}  // namespace

TEST_CASE("a shape is rebuilt from its own lengths and angles up to a rigid motion, from near and far poses") {
  const auto pipe = tube(13, 8);
  const auto ball = icosphere(2);
  const auto sheet = grid(8);
  struct Case {
    std::string name;
    Mesh mesh;
    Vertices shape, near;
    double accuracy;
  };
  const std::vector<Case> cases{{"itself", pipe, bend(pipe.vertices, 1), bend(pipe.vertices, 1), 1e-9},
                                {"moved", pipe, jitter(pipe.vertices, 0.03, 1), moveRigidly(pipe.vertices, 2), 1e-4},
                                {"bent", pipe, bend(pipe.vertices, 2.5), pipe.vertices, 1e-3},
                                {"ball", ball, jitter(ball.vertices, 0.05, 3), ball.vertices, 1e-6},
                                {"sheet", sheet, curl(sheet.vertices, 1.5), sheet.vertices, 1e-4}};
  for (const auto& [name, mesh, shape, near, accuracy] : cases) {
    INFO(name);
    const LengthAngleReconstruction reconstruction(mesh.topology);
    const auto wanted = measure(*mesh.topology, shape);
    const Vertices rebuilt = reconstruction.reconstruct(wanted, near);
    REQUIRE(rebuilt.rows() == shape.rows());
    CHECK(rigidGap(rebuilt, shape) < accuracy);
    CHECK(measureError(*mesh.topology, rebuilt, wanted) < 10 * accuracy);
    CHECK((rebuilt.colwise().mean() - near.colwise().mean()).norm() < 1e-9);  // aligned to the pose it started from
  }
}

TEST_CASE("halfway between two bent tubes the blended lengths and angles rebuild half the bend") {
  const auto pipe = tube(17, 8);
  const LengthAngleReconstruction reconstruction(pipe.topology);
  for (const double angle : {0.8, 2.0}) {
    const Vertices bent = bend(pipe.vertices, angle);
    const auto halfway = blendMeasures(measure(*pipe.topology, pipe.vertices), measure(*pipe.topology, bent), 0.5);
    const Vertices rebuilt = reconstruction.reconstruct(halfway, pipe.vertices);
    const double travelled = rigidGap(pipe.vertices, bent);
    CHECK(rigidGap(rebuilt, bend(pipe.vertices, 0.5 * angle)) < 0.02 * travelled);
    CHECK(rigidGap(rebuilt, pipe.vertices) > 0.2 * travelled);
  }
}

TEST_CASE("measures blend from one end to the other, beyond, and the short way round at pi") {
  const auto pipe = tube(5, 6);
  const auto a = measure(*pipe.topology, pipe.vertices), b = measure(*pipe.topology, 1.5 * bend(pipe.vertices, 1));
  const auto near = [](const Eigen::VectorXd& x, const Eigen::VectorXd& y) {
    return (x - y).norm() < 1e-12 * (1 + y.norm());
  };
  CHECK(near(blendMeasures(a, b, 0).squared_length, a.squared_length));
  CHECK(near(blendMeasures(a, b, 1).squared_length, b.squared_length));
  CHECK(near(blendMeasures(a, b, 1).angle, b.angle));
  CHECK(near(blendMeasures(a, b, 2).squared_length, b.squared_length.array().square() / a.squared_length.array()));
  CHECK(near(blendMeasures(a, b, 2).angle, 2 * b.angle - a.angle));
  ShellMeasures one = a, two = a;
  one.angle.setConstant(3.0);
  two.angle.setConstant(-3.1);
  CHECK(blendMeasures(one, two, 0.5).angle.maxCoeff() == Approx(0.5 * (3.0 + 2 * 3.14159265358979323846 - 3.1)));
}

TEST_CASE("wishes that no mesh can fulfil still give a shape, with every triangle alive") {
  const auto ball = icosphere(2);
  const LengthAngleReconstruction reconstruction(ball.topology);
  auto wanted = measure(*ball.topology, ball.vertices);
  for (Eigen::Index e = 0; e < wanted.squared_length.size(); ++e) wanted.squared_length[e] *= e % 3 == 0 ? 1.3 : 0.9;
  wanted.angle.array() += 0.2;
  const Vertices shape = reconstruction.reconstruct(wanted, ball.vertices);
  REQUIRE(shape.rows() == ball.vertices.rows());
  CHECK(shape.allFinite());
  CHECK(measure(*ball.topology, shape).area.minCoeff() > 0.1 * wanted.area.minCoeff());
}

TEST_CASE("the rebuilt shape does not depend on units") {
  const auto pipe = tube(9, 6);
  const LengthAngleReconstruction reconstruction(pipe.topology);
  const Vertices bent = bend(pipe.vertices, 1);
  const Vertices rebuilt = reconstruction.reconstruct(measure(*pipe.topology, bent), pipe.vertices);
  for (const double s : {1e-6, 1e5}) {
    const Vertices scaled = reconstruction.reconstruct(measure(*pipe.topology, s * bent), s * pipe.vertices);
    CHECK(rigidGap(scaled / s, rebuilt) < 1e-9);
  }
}
