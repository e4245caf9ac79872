#include "core/neural/jacobian_poisson.h"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <thread>

#include "core/io/frames.h"
#include "core/io/mesh_file.h"
#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "tests/support/real_data.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;

namespace {

std::shared_ptr<const JacobianPoisson> poissonOn(const Mesh& mesh, const Vertices& source) {
  return JacobianPoisson::make(mesh.topology, source);
}

Jacobians randomJacobians(Eigen::Index faces, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  return Jacobians::NullaryExpr(faces, 9, [&] { return uniform(random); });
}

Eigen::Matrix3d at(const Jacobians& jacobians, Eigen::Index face) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(jacobians.row(face).data());
}

/// The same matrix on every triangle.
Jacobians everywhere(const Eigen::Matrix3d& matrix, Eigen::Index faces) {
  const Eigen::Matrix3d transposed = matrix.transpose();
  return Eigen::Map<const Eigen::Matrix<double, 1, 9>>(transposed.data()).replicate(faces, 1);
}

double dot(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) { return a.cwiseProduct(b).sum(); }

/// A sphere, a tube and a sheet that do not touch, each jittered: three components with and without boundary.
Mesh threePieces() {
  const Mesh pieces[] = {icosphere(1), tube(8, 6), grid(5)};
  Eigen::Index vertices = 0, faces = 0;
  for (const auto& piece : pieces) vertices += piece.vertices.rows(), faces += piece.topology->faces().rows();
  Mesh all{nullptr, Vertices(vertices, 3)};
  Faces corners(faces, 3);
  vertices = faces = 0;
  for (const auto& [topology, shape] : pieces) {
    const Eigen::RowVector3d away(double(vertices), 0, 0);
    all.vertices.middleRows(vertices, shape.rows()) = jitter(shape, 0.03, 1).rowwise() + away;
    corners.middleRows(faces, topology->faces().rows()) = topology->faces().array() + int(vertices);
    vertices += shape.rows(), faces += topology->faces().rows();
  }
  all.topology = std::make_shared<Topology>(static_cast<std::int32_t>(vertices), corners);
  return all;
}

/// A triangle's Jacobian with nothing in common with the solver: by the metric of two of its edges.
Eigen::Matrix3d literalJacobian(const Faces& faces, const Vertices& source, const Vertices& shape, Eigen::Index face) {
  const auto corner = faces.row(face);
  Eigen::Matrix<double, 3, 2> from, to;
  from << (source.row(corner[1]) - source.row(corner[0])).transpose(),
      (source.row(corner[2]) - source.row(corner[0])).transpose();
  to << (shape.row(corner[1]) - shape.row(corner[0])).transpose(),
      (shape.row(corner[2]) - shape.row(corner[0])).transpose();
  return to * (from.transpose() * from).inverse() * from.transpose();
}

/// The shape nearest to given Jacobians by a dense least-squares solution of all triangles' equations, in which each
/// vertex's three coordinates are told apart by unit functions; centred by one more equation.
Vertices literalSolution(const Mesh& mesh, const Vertices& source, const Jacobians& jacobians,
                         const Eigen::RowVector3d& centroid) {
  const auto& faces = mesh.topology->faces();
  const auto areas = triangleAreas(faces, source);
  Eigen::MatrixXd equations = Eigen::MatrixXd::Zero(3 * faces.rows() + 1, source.rows());
  Eigen::MatrixXd right(3 * faces.rows() + 1, 3);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      Vertices hat = Vertices::Zero(source.rows(), 3);
      hat(faces(f, c), 0) = 1;
      const Eigen::Matrix3d gradient = literalJacobian(faces, source, hat, f);
      equations.col(faces(f, c)).segment<3>(3 * f) = std::sqrt(areas[f]) * gradient.row(0).transpose();
      equations(3 * faces.rows(), faces(f, c)) += areas[f] / 3;
    }
    right.middleRows<3>(3 * f) = std::sqrt(areas[f]) * at(jacobians, f).transpose();
  }
  right.bottomRows(1) = areas.sum() * centroid;
  return equations.colPivHouseholderQr().solve(right);
}

/// |x|^2 against a target, bent so that its gradient is not linear.
double energy(const Vertices& x) { return (x.array() - 0.2).sin().square().sum() + 0.1 * x.array().pow(4).sum(); }
Vertices energyGradient(const Vertices& x) { return (2 * (x.array() - 0.2)).sin() + 0.4 * x.array().cube(); }

}  // namespace

TEST_CASE("a shape comes back from its Jacobians, whatever shape it is") {
  for (const auto& mesh : {icosphere(3), tube(30, 20), grid(12)}) {
    const Vertices source = jitter(mesh.vertices, 0.01, 1);
    const auto poisson = poissonOn(mesh, source);
    CHECK((poisson->solve(poisson->jacobians(source)) - source).cwiseAbs().maxCoeff() < 1e-10);
    const Vertices other = jitter(bend(moveRigidly(2 * source, 5), 0.8), 0.5, 2);
    const auto jacobians = poisson->jacobians(other);
    CHECK((poisson->solve(jacobians, poisson->centroids(other)) - other).cwiseAbs().maxCoeff() < 1e-10);
    const Vertices centred = poisson->solve(jacobians);
    CHECK((poisson->centroids(centred) - poisson->centroids(source)).norm() < 1e-12);
    CHECK((poisson->jacobians(centred) - jacobians).cwiseAbs().maxCoeff() < 1e-9);
  }
}

TEST_CASE("Jacobians are those of each triangle's affine map, which loses the normal") {
  const auto mesh = tube(12, 9);
  const Vertices source = jitter(mesh.vertices, 0.02, 1), shape = jitter(bend(source, 0.5), 0.1, 2);
  const auto& faces = mesh.topology->faces();
  const auto poisson = poissonOn(mesh, source);
  const auto jacobians = poisson->jacobians(shape), own = poisson->jacobians(source);
  const Vertices normals = faceNormals(faces, source);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    CHECK((at(jacobians, f) - literalJacobian(faces, source, shape, f)).norm() < 1e-10);
    const Eigen::Vector3d edge = (source.row(faces(f, 2)) - source.row(faces(f, 1))).transpose();
    const Eigen::Vector3d image = (shape.row(faces(f, 2)) - shape.row(faces(f, 1))).transpose();
    const Eigen::Vector3d normal = normals.row(f).transpose();
    CHECK((at(jacobians, f) * edge - image).norm() < 1e-12);
    CHECK((at(jacobians, f) * normal).norm() < 1e-12);
    CHECK((at(own, f) - (Eigen::Matrix3d::Identity() - normal * normal.transpose())).norm() < 1e-12);
  }
  CHECK(poisson->areas().isApprox(triangleAreas(faces, source), 1e-14));
}

TEST_CASE("Jacobians of no shape are answered by the nearest in the least-squares sense") {
  const auto mesh = icosphere(1);
  const Vertices source = jitter(mesh.vertices, 0.1, 1);
  const auto poisson = poissonOn(mesh, source);
  const auto wanted = randomJacobians(poisson->areas().size(), 2);
  const Vertices solution = poisson->solve(wanted);
  const Vertices expected = literalSolution(mesh, source, wanted, poisson->centroids(source).row(0));
  CHECK((solution - expected).cwiseAbs().maxCoeff() < 1e-10);
  const auto misfit = [&](const Vertices& x) {
    return dot(poisson->areas().asDiagonal() * (poisson->jacobians(x) - wanted), poisson->jacobians(x) - wanted);
  };
  for (unsigned seed = 0; seed < 5; ++seed) CHECK(misfit(jitter(solution, 1e-3, seed)) > misfit(solution));
}

TEST_CASE("the same matrix everywhere maps the source by it") {
  const auto mesh = tube(16, 10);
  const auto poisson = poissonOn(mesh, mesh.vertices);
  Eigen::Matrix3d matrix;
  matrix << 0.3, -1.2, 0.4, 0.9, 0.1, 2, -0.5, 0.7, 1.1;
  const auto faces = poisson->areas().size();
  const Eigen::RowVector3d centre = poisson->centroids(mesh.vertices).row(0);
  const Vertices expected = ((mesh.vertices.rowwise() - centre) * matrix.transpose()).rowwise() + centre;
  CHECK((poisson->solve(everywhere(matrix, faces)) - expected).cwiseAbs().maxCoeff() < 1e-11);
  CHECK((poisson->solve(Jacobians::Zero(faces, 9)).rowwise() - centre).cwiseAbs().maxCoeff() < 1e-14);
}

TEST_CASE("turning the target turns the solution; turning or scaling the source turns or scales its Jacobians") {
  const auto mesh = icosphere(2);
  const Vertices source = jitter(mesh.vertices, 0.05, 1);
  const auto poisson = poissonOn(mesh, source);
  const auto wanted = randomJacobians(poisson->areas().size(), 3);
  const Vertices origin = Vertices::Zero(1, 3);
  const Vertices solution = poisson->solve(wanted, origin);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  Jacobians turned(wanted.rows(), 9), from_turned(wanted.rows(), 9);
  for (Eigen::Index f = 0; f < wanted.rows(); ++f) {
    const auto write = [&](Jacobians& to, const Eigen::Matrix3d& matrix) { to.row(f) = everywhere(matrix, 1); };
    write(turned, turn * at(wanted, f));
    write(from_turned, at(wanted, f) * turn.transpose() / 2);
  }
  CHECK((poisson->solve(turned, origin) - solution * turn.transpose()).cwiseAbs().maxCoeff() < 1e-11);
  const auto moved = poissonOn(mesh, (2 * source * turn.transpose()).rowwise() + Eigen::RowVector3d(3, 1, 2));
  CHECK((moved->solve(from_turned, origin) - solution).cwiseAbs().maxCoeff() < 1e-11);
  CHECK((moved->solve(wanted, origin) - solution).cwiseAbs().maxCoeff() > 0.01);
}

TEST_CASE("components are solved for apart and each centred on its own") {
  const auto mesh = threePieces();
  const auto poisson = poissonOn(mesh, mesh.vertices);
  REQUIRE(poisson->topology().componentCount() == 3);
  const Vertices shape = jitter(1.5 * mesh.vertices, 0.3, 4);
  const auto jacobians = poisson->jacobians(shape);
  CHECK((poisson->solve(jacobians, poisson->centroids(shape)) - shape).cwiseAbs().maxCoeff() < 1e-10);
  const Vertices centred = poisson->solve(jacobians);
  CHECK((poisson->centroids(centred) - poisson->centroids(mesh.vertices)).cwiseAbs().maxCoeff() < 1e-12);
  Jacobians changed = jacobians;
  changed.bottomRows(1) *= 3;  // on the sheet alone
  const Vertices gap = poisson->solve(changed) - centred;
  CHECK(gap.topRows(42).cwiseAbs().maxCoeff() < 1e-12);
  CHECK(gap.bottomRows(25).cwiseAbs().maxCoeff() > 1e-3);
}

TEST_CASE("backward is the transpose of solve") {
  for (const auto& mesh : {icosphere(2), threePieces()}) {
    const auto poisson = poissonOn(mesh, jitter(mesh.vertices, 0.02, 1));
    const auto faces = poisson->areas().size();
    const Vertices nothing = poisson->solve(Jacobians::Zero(faces, 9));
    for (unsigned seed = 1; seed < 5; ++seed) {
      const auto wanted = randomJacobians(faces, seed);
      const Vertices gradient = jitter(Vertices::Zero(mesh.vertices.rows(), 3), 1, 10 + seed);
      const double forward = dot(poisson->solve(wanted) - nothing, gradient);
      CHECK(dot(wanted, poisson->backward(gradient)) == Approx(forward).epsilon(1e-11));
    }
  }
}

TEST_CASE("backward is the gradient of an energy of the solution, by central differences") {
  const auto mesh = threePieces();
  const auto poisson = poissonOn(mesh, mesh.vertices);
  const auto start = randomJacobians(poisson->areas().size(), 6);
  const auto value = [&](const Jacobians& jacobians) { return energy(0.1 * poisson->solve(jacobians)); };
  const Jacobians gradient = poisson->backward(0.1 * energyGradient(0.1 * poisson->solve(start)));
  constexpr double step = 1e-4;
  for (const auto& [face, entry] : {std::pair{0, 0}, {3, 4}, {40, 8}, {90, 2}, {130, 7}, {190, 5}}) {
    Jacobians plus = start, minus = start;
    plus(face, entry) += step, minus(face, entry) -= step;
    const double expected = (value(plus) - value(minus)) / (2 * step);
    CHECK(gradient(face, entry) == Approx(expected).epsilon(1e-6).margin(1e-7 * gradient.cwiseAbs().maxCoeff()));
  }
  for (unsigned seed = 7; seed < 10; ++seed) {
    const auto direction = randomJacobians(start.rows(), seed);
    const double expected = (value(start + step * direction) - value(start - step * direction)) / (2 * step);
    CHECK(dot(gradient, direction) == Approx(expected).epsilon(1e-6));
  }
}

TEST_CASE("a shape far from the origin keeps its Jacobians") {
  const auto mesh = icosphere(2);
  const auto poisson = poissonOn(mesh, mesh.vertices);
  const Vertices far = mesh.vertices.rowwise() + Eigen::RowVector3d(1e6, -1e6, 1e6);
  CHECK((poisson->jacobians(far) - poisson->jacobians(mesh.vertices)).cwiseAbs().maxCoeff() < 1e-8);
}

TEST_CASE("bodies come back from their Jacobians over the template") {
  const auto file = realData("body_identities/template.ply"), frames = realData("body_identities/rest_f32.npy");
  if (!file || !frames) return;
  const auto body = readMesh(*file);
  const auto topology = std::make_shared<Topology>(static_cast<std::int32_t>(body.vertices.rows()), body.faces);
  const auto poisson = JacobianPoisson::make(topology, body.vertices);
  const auto identities = readFrames(*frames);
  for (const std::size_t i : {0, 40, 119}) {
    const auto jacobians = poisson->jacobians(identities[i]);
    CHECK((poisson->solve(jacobians, poisson->centroids(identities[i])) - identities[i]).cwiseAbs().maxCoeff() < 1e-11);
  }
}

TEST_CASE("several threads may solve with one factor and agree with one thread") {
  const auto mesh = icosphere(3);
  const auto poisson = poissonOn(mesh, mesh.vertices);
  const auto wanted = randomJacobians(poisson->areas().size(), 1);
  const Vertices alone = poisson->solve(wanted);
  const Jacobians back = poisson->backward(alone);
  std::vector<int> different(3, 0);
  std::vector<std::thread> threads;
  for (auto& count : different)
    threads.emplace_back([&] {
      for (int i = 0; i < 20; ++i) count += poisson->solve(wanted) != alone || poisson->backward(alone) != back;
    });
  for (auto& thread : threads) thread.join();
  CHECK(different == std::vector<int>(3, 0));
}

TEST_CASE("a Poisson solver that is stopped is none, and it knows its size") {
  const auto mesh = icosphere(2);
  std::stop_source stop;
  stop.request_stop();
  CHECK(JacobianPoisson::make(mesh.topology, mesh.vertices, stop.get_token()) == nullptr);
  CHECK(poissonOn(mesh, mesh.vertices)->bytes() > 320 * 9 * sizeof(double));
}

TEST_CASE("a Poisson solver refuses what does not fit its source by name") {
  const auto mesh = icosphere(1);
  CHECK_THROWS_WITH(poissonOn(mesh, mesh.vertices.topRows(3)), Catch::Contains("source: has 3 vertices, want 42"));
  CHECK_THROWS_WITH(poissonOn(mesh, Vertices::Zero(42, 3)), Catch::Contains("source: face 0"));
  const auto poisson = poissonOn(mesh, mesh.vertices);
  CHECK_THROWS_WITH(poisson->solve(Jacobians::Zero(79, 9)), Catch::Contains("jacobians: has 79 rows, want 80"));
  CHECK_THROWS_WITH(poisson->solve(Jacobians::Zero(80, 9), Vertices::Zero(2, 3)),
                    Catch::Contains("centroids: has 2 rows, want 1"));
  CHECK_THROWS_WITH(poisson->backward(Vertices::Zero(80, 3)), Catch::Contains("gradient: has 80 rows, want 42"));
  CHECK_THROWS_WITH(poisson->jacobians(Vertices::Zero(41, 3)), Catch::Contains("shape: has 41 rows, want 42"));
  Jacobians broken = Jacobians::Zero(80, 9);
  broken(4, 4) = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(poisson->solve(broken), Catch::Contains("jacobians: holds a number that is not finite"));
}
