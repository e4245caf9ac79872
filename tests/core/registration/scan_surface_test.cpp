#include "core/registration/scan_surface.h"

#include <catch2/catch.hpp>
#include <random>
#include <thread>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/registration/scan_checks.h"
#include "tests/core/registration/scanned_shapes.h"

using namespace shaped;
using namespace shaped::test;
using Catch::Matchers::Contains;

namespace {

Vertices randomPoints(int count, double half_width, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-half_width, half_width);
  Vertices points(count, 3);
  for (auto& x : points.reshaped()) x = uniform(random);
  return points;
}

/// Points of the flat unit square.
Scan flatPoints(int count) {
  Scan scan{randomPoints(count, 0.5, 5), {}, {}};
  scan.points.col(2).setZero();
  return scan;
}

}  // namespace

TEST_CASE("nearest points of a set are those of a search through all, in order") {
  const Vertices points = randomPoints(500, 1, 3), queries = randomPoints(50, 1.5, 4);
  const PointTree tree(points);
  for (Eigen::Index q = 0; q < queries.rows(); ++q) {
    const Eigen::RowVector3d query = queries.row(q);
    Eigen::VectorXd squares = (points.rowwise() - query).rowwise().squaredNorm();
    std::vector<NearPoint> found(7);
    REQUIRE(tree.nearest(query, found) == 7);
    std::sort(squares.begin(), squares.end());
    for (int n = 0; n < 7; ++n) CHECK(found[std::size_t(n)].squared_distance == Approx(squares[n]));
    CHECK(tree.nearest(query).index == found[0].index);
  }
  std::vector<NearPoint> more(600);
  CHECK(tree.nearest(queries.row(0), more) == 500);
}

TEST_CASE("a mesh scan knows closest point, normal and boundary") {
  const ScanSurface scan(scanMesh(grid(12)));
  CHECK(scan.isMesh());
  CHECK(scan.hasOrientedNormals());
  const ScanPoint inside = scan.closest({0.4, 0.6, 0.3});
  CHECK(inside.position.isApprox(Eigen::RowVector3d(0.4, 0.6, 0)));
  CHECK(inside.distance == Approx(0.3));
  CHECK(std::abs(inside.normal[2]) == Approx(1));
  CHECK_FALSE(inside.boundary);
  CHECK(scan.closest({1.2, 0.53, 0.1}).boundary);
  CHECK(scan.closest({1.2, 1.3, 0}).boundary);
  CHECK_FALSE(scan.closest({0.999, 0.53, 0}).boundary);
}

TEST_CASE("a closed mesh has no boundary anywhere") {
  const ScanSurface scan(scanMesh(icosphere(3)));
  CHECK(scan.boundaryShare() == 0);
  const Vertices queries = randomPoints(200, 2, 7);
  for (Eigen::Index q = 0; q < 200; ++q) CHECK_FALSE(scan.closest(queries.row(q)).boundary);
}

TEST_CASE("estimated normals of a sphere's points lie along the radius, and no sign is claimed") {
  Scan points = scanPoints(icosphere(4), 3000);
  points.normals.resize(0, 3);
  const ScanSurface scan(points);
  CHECK_FALSE(scan.hasOrientedNormals());
  double worst = 1;
  for (Eigen::Index p = 0; p < scan.points().rows(); ++p)
    worst = std::min(worst, std::abs(scan.normals().row(p).dot(scan.points().row(p).normalized())));
  CHECK(worst > std::cos(8 * M_PI / 180));
}

TEST_CASE("the rim of a point scan is found, and little else") {
  const ScanSurface scan(flatPoints(3000));
  int rim = 0, found = 0, inside = 0, wrong = 0;
  for (Eigen::Index p = 0; p < scan.points().rows(); ++p) {
    const double to_edge = 0.5 - scan.points().row(p).cwiseAbs().maxCoeff();
    const bool boundary = scan.closest(scan.points().row(p)).boundary;
    if (to_edge < 0.003) ++rim, found += boundary;
    if (to_edge > 0.05) ++inside, wrong += boundary;
  }
  CHECK(found > 0.85 * rim);
  CHECK(wrong < 0.01 * inside);
  // a query from beyond the rim meets a rim point
  int beyond = 0;
  for (int i = 0; i < 50; ++i) beyond += scan.closest({0.7, -0.45 + 0.018 * i, 0}).boundary;
  CHECK(beyond > 42);
}

TEST_CASE("the back of a thin plate does not hide its front's rim while normals have a sign") {
  Scan plate = flatPoints(6000);
  plate.normals = Vertices::Zero(6000, 3);
  for (Eigen::Index p = 0; p < 6000; ++p) {
    const double side = p % 2 ? 1 : -1;
    if (side > 0 && plate.points(p, 0) > 0) plate.points(p, 0) -= 0.5;  // the front reaches to x = 0 only
    plate.points(p, 2) = 0.004 * side;
    plate.normals(p, 2) = side;
  }
  const auto share = [&](bool signs) {
    Scan scan = plate;
    if (!signs) scan.normals.resize(0, 3);
    const ScanSurface surface(scan);
    int boundary = 0, near = 0;
    for (Eigen::Index p = 1; p < 6000; p += 2)
      if (scan.points(p, 0) > -0.004 && std::abs(scan.points(p, 1)) < 0.45)
        ++near, boundary += surface.closest(scan.points.row(p)).boundary;
    return double(boundary) / near;
  };
  CHECK(share(true) > 0.8);
  CHECK(share(false) < 0.3);
}

TEST_CASE("normals that point inwards are reported, whether given or wound") {
  const Mesh mesh = icosphere(4);
  for (const Scan& scan : {scanPoints(mesh, 2000), scanMesh(mesh)}) {
    const auto right = compareNormals(ScanSurface(scan), 1.05 * mesh.vertices, mesh.topology->faces(), 0.2);
    const auto wrong = compareNormals(ScanSurface(flipped(scan)), 1.05 * mesh.vertices, mesh.topology->faces(), 0.2);
    CHECK(right.compared > 0.95 * double(mesh.vertices.rows()));
    CHECK(right.opposing == 0);
    CHECK(wrong.opposing == 1);
    CHECK(compareNormals(ScanSurface(scan), 2 * mesh.vertices, mesh.topology->faces(), 0.2).compared == 0);
  }
}

TEST_CASE("several threads may query one scan and agree with one thread") {
  const Vertices queries = randomPoints(400, 1.5, 9);
  for (const Scan& scan : {scanPoints(icosphere(3), 1000), scanMesh(icosphere(3))}) {
    const ScanSurface surface(scan);
    std::vector<std::vector<std::int32_t>> found(3, std::vector<std::int32_t>(400));
    std::vector<std::thread> threads;
    for (auto& mine : found)
      threads.emplace_back([&] {
        for (Eigen::Index q = 0; q < 400; ++q) mine[std::size_t(q)] = surface.closest(queries.row(q)).index;
      });
    for (auto& thread : threads) thread.join();
    CHECK(found[0] == found[1]);
    CHECK(found[0] == found[2]);
  }
}

TEST_CASE("unusable scans are refused by field, index and what would do") {
  const auto message = [](const Scan& scan) {
    try {
      requireUsableScan(scan, "scan");
    } catch (const InvalidInput& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  const Scan good = scanPoints(icosphere(2), 200);
  CHECK(message(good) == "accepted");
  CHECK(message({}) == "scan: has no points");
  CHECK(message(scanPoints(icosphere(2), 99)) == "scan: has 99 points, want at least 100");
  Scan bad = good;
  bad.points(17, 1) = NAN;
  CHECK_THAT(message(bad), Contains("scan.points[17]") && Contains("not a finite number"));
  bad = good;
  bad.normals(3, 0) = INFINITY;
  CHECK_THAT(message(bad), Contains("scan.normals[3]"));
  bad = good;
  bad.normals.conservativeResize(150, 3);
  CHECK_THAT(message(bad), Contains("scan.normals: has 150 rows, want 200"));
  bad = scanMesh(icosphere(2));
  bad.faces(5, 2) = 162;
  CHECK_THAT(message(bad), Contains("scan.faces[5]") && Contains("[0, 162)"));
  bad = good;
  bad.points.setConstant(2);
  CHECK_THAT(message(bad), Contains("one place"));
  CHECK_THROWS_WITH(ScanSurface(good, {.normal_neighbours = 2, .rim = {}}),
                    Contains("normal_neighbours = 2, want >= 3"));
}

TEST_CASE("a wrong unit is suspected, a mere difference of size is not") {
  const Mesh mesh = hook();
  const double extent = robustExtent(mesh.vertices);
  CHECK(robustExtent(moveRigidly(mesh.vertices, 3)) == Approx(extent).epsilon(0.2));
  for (const double unit : {1000.0, 100.0, 10.0, 0.1, 0.01, 0.001}) {
    Scan scan = withStrayPoints(scanPoints(mesh, 3000), 40, 1, 4);
    scan.points *= unit * 1.3;
    const auto factor = suspectedUnitFactor(scan, extent);
    REQUIRE(factor);
    CHECK(*factor == Approx(1 / unit));
  }
  for (const double size : {0.5, 1.0, 2.0}) {
    Scan scan = scanPoints(mesh, 3000);
    scan.points *= size;
    CHECK_FALSE(suspectedUnitFactor(scan, extent));
  }
  CHECK_THROWS_WITH(suspectedUnitFactor(scanPoints(mesh, 300), 0), Contains("template_extent"));
}
