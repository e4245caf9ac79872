#include "core/registration/gates.h"

#include <catch2/catch.hpp>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "tests/core/registration/scanned_shapes.h"

using namespace shaped;
using namespace shaped::test;
using Catch::Matchers::Contains;

TEST_CASE("a robust loss's weight is its derivative, it starts as r^2 and stays below its scale's square") {
  for (const auto kind : {RobustLoss::Kind::kSquares, RobustLoss::Kind::kGemanMcClure, RobustLoss::Kind::kWelsch}) {
    const RobustLoss loss{kind, 0.3};
    for (const double r : {0.01, 0.1, 0.3, 1.0}) {
      const double square = r * r, step = 1e-6 * square;
      CHECK(loss.weight(square) ==
            Approx((loss.value(square + step) - loss.value(square - step)) / (2 * step)).epsilon(1e-6));
    }
    CHECK(loss.value(1e-8) == Approx(1e-8).epsilon(1e-5));
    if (kind != RobustLoss::Kind::kSquares) CHECK(loss.value(1e6) <= 0.09);
  }
}

TEST_CASE("each gate leaves out what it names, counted under its cause") {
  const Mesh square = grid(20);
  const ScanSurface scan(scanMesh(square));
  const Vertices up = vertexNormals(square.topology->faces(), square.vertices);
  Vertices queries = square.vertices, normals = up;
  queries.col(0).array() += 0.5;  // the right half lies beyond the scan
  queries.row(0) = Eigen::RowVector3d(0.5, 0.5, 0.7);
  normals.row(21) *= -1;
  CorrespondenceGates gates{1, 60, true};
  const auto with = [&](CorrespondenceGates changed) { return findCorrespondences(scan, queries, normals, changed); };
  auto found = with(gates);
  CHECK(found.too_far == 0);
  CHECK(found.wrong_normal == 1);
  CHECK(found.at_boundary > 180);
  CHECK(found.acceptedCount() + found.at_boundary + 1 == 400);
  CHECK(found.accepted.sum() == double(found.acceptedCount()));

  gates.reject_boundary = false;
  CHECK(with(gates).at_boundary == 0);
  gates.max_normal_angle = 180;
  CHECK(with(gates).acceptedCount() == 400);
  gates.max_distance = 0.6;
  found = with(gates);
  CHECK(found.too_far == 1);
  CHECK(found.accepted[0] == 0);
  CHECK(found.distances[0] == Approx(0.7));
}

TEST_CASE("normals without a sign are compared as lines") {
  Scan points = scanPoints(icosphere(4), 2000);
  const Mesh inside = icosphere(3);
  const Vertices inwards = -vertexNormals(inside.topology->faces(), inside.vertices);
  CHECK(findCorrespondences(ScanSurface(points), inside.vertices, inwards, {}).acceptedCount() == 0);
  points.normals.resize(0, 3);
  CHECK(findCorrespondences(ScanSurface(points), inside.vertices, inwards, {}).acceptedCount() > 620);
}

TEST_CASE("gates out of range are refused by name") {
  const ScanSurface scan(scanMesh(icosphere(3)));
  const Vertices none(0, 3);
  CHECK_THROWS_WITH(findCorrespondences(scan, none, none, {0, 60, true}), Contains("max_distance"));
  CHECK_THROWS_WITH(findCorrespondences(scan, none, none, {1, 181, true}), Contains("max_normal_angle"));
  CHECK_THROWS_WITH(findCorrespondences(scan, Vertices::Zero(2, 3), none, {}), Contains("normals: has 0 rows, want 2"));
}
