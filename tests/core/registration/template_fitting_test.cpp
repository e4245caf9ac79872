#include "core/registration/template_fitting.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/registration/fitting_report.h"
#include "core/registration/rigid_start.h"
#include "core/surface/closest_point.h"
#include "tests/core/registration/scanned_shapes.h"

using namespace shaped;
using namespace shaped::test;
using Catch::Matchers::Contains;

namespace {

/// A smooth change of shape of about a tenth of the size.
Vertices swell(const Vertices& shape) {
  Vertices changed = shape;
  for (Eigen::Index v = 0; v < shape.rows(); ++v) {
    const double x = shape(v, 0), y = shape(v, 1), z = shape(v, 2);
    changed.row(v) << 1.1 * x + 0.06 * std::sin(2 * y), 0.95 * y + 0.05 * std::cos(2 * z), z * (1 + 0.12 * x);
  }
  return changed;
}

Mesh swollen(const Mesh& mesh) { return {mesh.topology, swell(mesh.vertices)}; }

FittingOptions options() {
  FittingOptions options;
  options.first_stiffness = 1;
  options.levels = 6;
  options.last_stiffness = 1e-4;
  options.gates.max_distance = 0.3;
  options.first_max_distance = 0.6;
  options.loss.scale = 0.05;
  return options;
}

Solved<FittedTemplate> fit(const Scan& scan, const Mesh& mesh, const FittingOptions& with = options(),
                           const std::vector<Landmark>& landmarks = {}) {
  return fitTemplate(ScanSurface(scan), *mesh.topology, mesh.vertices, landmarks, with);
}

double meanDistance(const Vertices& fitted, const Mesh& truth) {
  return distancesToSurface(fitted, truth.vertices, truth.topology->faces()).mean();
}

Landmark landmarkOn(std::int32_t face, const Eigen::Vector3d& position) {
  Landmark landmark;
  landmark.anchor.face = face;
  landmark.position = position;
  return landmark;
}

/// The part of a mesh whose triangles have no corner within `radius` of a point.
Scan withHole(const Mesh& mesh, const Eigen::RowVector3d& centre, double radius) {
  std::vector<Eigen::Index> rows;
  const auto& faces = mesh.topology->faces();
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    bool keep = true;
    for (int c = 0; c < 3; ++c) keep = keep && (mesh.vertices.row(faces(f, c)) - centre).norm() > radius;
    if (keep) rows.push_back(f);
  }
  return {mesh.vertices, {}, faces(rows, Eigen::all)};
}

}  // namespace

TEST_CASE("a template is fitted to a smoothly deformed one, from a mesh and from points") {
  const Mesh mesh = icosphere(3), truth = swollen(mesh);
  for (const Scan& scan : {scanMesh(truth), scanPoints(truth, 8000)}) {
    const auto fitted = fit(scan, mesh);
    CHECK(fitted.converged());
    CHECK(meanDistance(fitted.solution.vertices, truth) < 0.003);
    CHECK(meanDistance(mesh.vertices, truth) > 0.03);
    CHECK(meanVertexDistance(fitted.solution.vertices, truth.vertices) <
          0.8 * meanVertexDistance(mesh.vertices, truth.vertices));
    CHECK(fitted.solution.report.gated_out < 0.01);
    CHECK(fitted.solution.report.flipped == 0);
    CHECK(fitted.solution.report.smallest_area_ratio > 0.4);
    CHECK(fitted.solution.levels.size() == 6);
    CHECK(fitted.solution.report.median_distance < 0.003);
  }
}

TEST_CASE("an affine change of a shape without symmetry is undone vertex by vertex") {
  const Mesh mesh = hook();
  Eigen::Matrix3d linear;
  linear << 1.08, 0.05, 0, -0.04, 0.95, 0.03, 0, 0.05, 1.05;
  const Mesh truth{mesh.topology, mesh.vertices * linear.transpose()};
  FittingOptions stiff = options();
  stiff.levels = 1;
  stiff.first_stiffness = stiff.last_stiffness = 10;
  stiff.steps_per_level = 400;
  stiff.tolerance = 1e-8;
  stiff.first_max_distance = stiff.gates.max_distance = 1;
  const auto fitted = fit(scanMesh(truth), mesh, stiff);
  CHECK(maxVertexDistance(mesh.vertices, truth.vertices) > 0.1);
  CHECK(maxVertexDistance(fitted.solution.vertices, truth.vertices) < 2e-3);
}

TEST_CASE("with correspondences that none leaves out the energy of a level never rises") {
  const Mesh mesh = icosphere(3), truth = swollen(mesh);
  FittingOptions open = options();
  open.gates = {10, 180, false};
  open.first_max_distance = 10;
  open.levels = 1;
  open.tolerance = 1e-12;
  for (const auto method : {FittingMethod::kAffine, FittingMethod::kDisplacement, FittingMethod::kEdgeLengths}) {
    open.method = method;
    open.first_stiffness = open.last_stiffness = method == FittingMethod::kDisplacement ? 0.1 : 1e-3;
    double last = std::numeric_limits<double>::infinity();
    for (int steps = 1; steps < 12; ++steps) {
      open.steps_per_level = steps;
      const auto fitted = fit(scanMesh(truth), mesh, open);
      CHECK(fitted.solution.levels[0].energy_at_end <= last * (1 + 1e-9));
      CHECK(fitted.solution.levels[0].energy_at_end < fitted.solution.levels[0].energy_at_start);
      last = fitted.solution.levels[0].energy_at_end;
    }
  }
}

TEST_CASE("fitting moves rigidly with scan and template") {
  const Mesh mesh = hook();
  const Mesh truth = swollen(mesh);
  const RigidMotion motion = randomMotion(4);
  const Mesh elsewhere{mesh.topology, apply(motion, mesh.vertices)};
  const auto here = fit(scanMesh(truth), mesh);
  const auto there = fit(moved(scanMesh(truth), motion), elsewhere);
  CHECK(maxVertexDistance(apply(motion, here.solution.vertices), there.solution.vertices) < 0.02);
  CHECK(meanVertexDistance(apply(motion, here.solution.vertices), there.solution.vertices) < 1e-3);
}

TEST_CASE("the robust loss keeps stray points from pulling the template out, squares do not") {
  const Mesh mesh = icosphere(3), truth = swollen(mesh);
  const Scan scan = withStrayPoints(scanPoints(truth, 8000), 20, 0.1, 3);
  FittingOptions robust = options(), squares = options();
  robust.loss.scale = 0.01;
  squares.loss.kind = RobustLoss::Kind::kSquares;
  robust.gates.reject_boundary = squares.gates.reject_boundary = false;  // the rim test finds many stray points, too
  robust.gates.max_normal_angle = squares.gates.max_normal_angle = 180;
  const double with = meanDistance(fit(scan, mesh, robust).solution.vertices, truth);
  const double without = meanDistance(fit(scan, mesh, squares).solution.vertices, truth);
  CHECK(with < 0.006);
  CHECK(without > 1.5 * with);
}

TEST_CASE("a hole is filled smoothly, and the boundary gate is what keeps it round") {
  const Mesh mesh = icosphere(4), truth = swollen(mesh);
  const Eigen::RowVector3d centre = truth.vertices.row(0);
  const Scan scan = withHole(truth, centre, 0.45);
  FittingOptions gated = options(), open = options();
  open.gates.reject_boundary = false;
  const auto inHole = [&](const Vertices& fitted) {
    const Eigen::VectorXd distances = distancesToSurface(fitted, truth.vertices, truth.topology->faces());
    double sum = 0, count = 0;
    for (Eigen::Index v = 0; v < fitted.rows(); ++v)
      if ((truth.vertices.row(v) - centre).norm() < 0.35) sum += distances[v], ++count;
    return sum / count;
  };
  const auto with = fit(scan, mesh, gated), without = fit(scan, mesh, open);
  CHECK(with.solution.report.at_boundary > 0.02);
  CHECK(inHole(with.solution.vertices) < 0.03);
  CHECK(inHole(without.solution.vertices) > 1.5 * inHole(with.solution.vertices));
}

TEST_CASE("the normal gate keeps a template from a wall that faces the other way") {
  // a scan of a thick shell: the inner wall is nearer to the template, but faces inwards
  const Mesh mesh = icosphere(3);
  Scan outer = scanMesh({mesh.topology, 1.2 * mesh.vertices}),
       inner = flipped(scanMesh({mesh.topology, 1.08 * mesh.vertices}));
  Scan both;
  both.points.resize(2 * outer.points.rows(), 3);
  both.points << outer.points, inner.points;
  both.faces.resize(2 * outer.faces.rows(), 3);
  both.faces << outer.faces, (inner.faces.array() + std::int32_t(outer.points.rows())).matrix();
  FittingOptions blind = options();
  blind.gates.max_normal_angle = 180;
  const auto misled = fit(both, mesh, blind), kept = fit(both, mesh);
  CHECK(misled.solution.vertices.rowwise().norm().mean() == Approx(1.08).epsilon(0.01));
  // every closest point is on the wrong wall: with the gate nothing is left, and that is what it says
  CHECK(kept.termination == Termination::kNumericalFailure);
  CHECK(kept.solution.vertices == mesh.vertices);
  CHECK(kept.solution.report.wrong_normal == 1);
}

TEST_CASE("landmarks pull the template along where the shape leaves it open") {
  const Mesh mesh = icosphere(3);
  const RigidMotion turn{Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()).toRotationMatrix(), {0, 0, 0}};
  const Vertices truth = apply(turn, mesh.vertices);
  std::vector<Landmark> landmarks;
  for (std::int32_t face = 0; face < 1280; face += 100) {
    const Anchor anchor{face, {0.2, 0.3, 0.5}, {0, 0, 0}};
    landmarks.push_back({anchor, position(anchor, mesh.topology->faces(), truth), 1});
  }
  FittingOptions with = options();
  with.landmark_weight = 1;
  with.steps_per_level = 40;
  const auto pulled = fit(scanMesh(mesh), mesh, with, landmarks), free = fit(scanMesh(mesh), mesh);
  CHECK(meanVertexDistance(pulled.solution.vertices, truth) < 0.05);
  CHECK(meanVertexDistance(free.solution.vertices, truth) > 0.3);
  CHECK(pulled.solution.report.landmark_distance < 0.02);
  CHECK(meanDistance(pulled.solution.vertices, mesh) < 0.01);
}

TEST_CASE("the plain deformations come near the scan as well, by tearing the surface more") {
  const Mesh mesh = icosphere(3), truth = swollen(mesh);
  const Scan scan = scanPoints(truth, 8000);
  FittingOptions plain = options();
  plain.method = FittingMethod::kDisplacement;
  const auto displaced = fit(scan, mesh, plain);
  plain.method = FittingMethod::kEdgeLengths;
  const auto isometric = fit(scan, mesh, plain);
  CHECK(meanDistance(displaced.solution.vertices, truth) < 0.01);
  CHECK(meanDistance(isometric.solution.vertices, truth) < 0.02);
}

TEST_CASE("how a fit ended is told: limit, stop, nothing in reach") {
  const Mesh mesh = icosphere(3), truth = swollen(mesh);
  FittingOptions one = options();
  one.steps_per_level = 1;
  one.tolerance = 1e-9;
  const auto limited = fit(scanMesh(truth), mesh, one);
  CHECK(limited.termination == Termination::kIterationLimit);
  CHECK(limited.iterations == 6);
  CHECK(limited.residual > 1e-9);
  std::stop_source stop;
  stop.request_stop();
  const auto stopped =
      fitTemplate(ScanSurface(scanMesh(truth)), *mesh.topology, mesh.vertices, {}, options(), stop.get_token());
  CHECK(stopped.termination == Termination::kCancelled);
  CHECK(stopped.solution.levels.size() == 1);
  CHECK(stopped.solution.vertices == mesh.vertices);
  Scan far = scanMesh(truth);
  far.points.array() += 100;
  const auto lost = fit(far, mesh);
  CHECK(lost.termination == Termination::kNumericalFailure);
  CHECK(lost.solution.vertices == mesh.vertices);
  CHECK(lost.solution.report.too_far == 1);
  CHECK(lost.solution.report.gated_out == 1);
}

TEST_CASE("triangles that turned over are counted, those that were before are not") {
  const Mesh mesh = grid(8);
  Vertices folded = mesh.vertices;
  folded(27, 0) += 0.3;
  CHECK(flippedTriangles(mesh.topology->faces(), mesh.vertices, mesh.vertices) == 0);
  CHECK(flippedTriangles(mesh.topology->faces(), mesh.vertices, folded) > 0);
  CHECK(flippedTriangles(mesh.topology->faces(), folded, folded) == 0);
}

TEST_CASE("fitting options and landmarks out of range are named") {
  const Mesh mesh = icosphere(3);
  const auto with = [&](auto change) {
    FittingOptions changed = options();
    change(changed);
    return changed.firstViolation().value_or("fine");
  };
  CHECK(with([](auto&) {}) == "fine");
  CHECK_THAT(with([](auto& o) { o.levels = 0; }), Contains("levels = 0, want >= 1"));
  CHECK_THAT(with([](auto& o) { o.last_stiffness = 20; }), Contains("last_stiffness"));
  CHECK_THAT(with([](auto& o) { o.gates.max_distance = 0; }), Contains("gates.max_distance"));
  CHECK_THAT(with([](auto& o) { o.first_max_distance = 0.1; }), Contains("first_max_distance"));
  CHECK_THAT(with([](auto& o) { o.sliding = 1.5; }), Contains("sliding"));
  CHECK_THAT(with([](auto& o) { o.tolerance = 0; }), Contains("tolerance"));
  CHECK_THROWS_WITH(fit(scanMesh(mesh), mesh, options(), {landmarkOn(1280, {0, 0, 0})}),
                    Contains("landmarks[0]") && Contains("face 1280"));
  CHECK_THROWS_WITH(fit(scanMesh(mesh), mesh, options(), {landmarkOn(0, {0, 0, NAN})}), Contains("not finite"));
  Mesh wrong = mesh;
  wrong.vertices.conservativeResize(100, 3);
  CHECK_THROWS_WITH(fit(scanMesh(mesh), wrong), Contains("placed"));
}

TEST_CASE("the mean body is fitted to a body scan") {
  const auto body = meanBody();
  if (!body) return;
  const BodyScan scan = bodyScan(8);
  const ScanSurface surface(scan.scan);
  const auto start = startRigidly(surface, body->vertices, body->topology->faces());
  const Vertices placed = apply(start.solution.similarity, body->vertices);
  FittingOptions quick;
  quick.levels = 5;
  quick.steps_per_level = 6;
  const auto fitted = fitTemplate(surface, *body->topology, placed, {}, quick);
  const auto to_surface = distancesToSurface(fitted.solution.vertices, scan.truth, body->topology->faces());
  CHECK(to_surface.mean() < 0.006);
  CHECK(meanVertexDistance(fitted.solution.vertices, scan.truth) < 0.6 * meanVertexDistance(placed, scan.truth));
  CHECK(fitted.solution.report.median_distance < 0.002);
}
