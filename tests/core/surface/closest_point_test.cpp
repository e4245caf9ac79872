#include "core/surface/closest_point.h"

#include <catch2/catch.hpp>
#include <random>
#include <thread>

#include "core/numerics/error.h"

using namespace shaped;

namespace {

using Point = Eigen::RowVector3d;

Point randomPoint(std::mt19937& random, double half_width) {
  std::uniform_real_distribution<double> uniform(-half_width, half_width);
  return {uniform(random), uniform(random), uniform(random)};
}

struct Mesh {
  Vertices vertices;
  Faces faces;
};

/// Triangles of very different sizes, slivers among them, far from the origin.
Mesh triangleSoup(int count, const Point& centre) {
  std::mt19937 random(7);
  Mesh mesh{Vertices(3 * count, 3), Faces(count, 3)};
  for (int f = 0; f < count; ++f) {
    const Point corner = randomPoint(random, 1);
    const double size = f % 10 == 0 ? 0.5 : 0.02;
    const Point edge = randomPoint(random, size);
    mesh.vertices.row(3 * f) = centre + corner;
    mesh.vertices.row(3 * f + 1) = centre + corner + edge;
    mesh.vertices.row(3 * f + 2) = centre + corner + (f % 7 == 0 ? Point(0.5 * edge) : randomPoint(random, size));
    mesh.faces.row(f) << 3 * f, 3 * f + 1, 3 * f + 2;
  }
  return mesh;
}

/// Smallest distance over a dense sample of the triangle: an upper bound that a closest point must reach or beat.
double sampledDistance(const Point& query, const Point& a, const Point& b, const Point& c) {
  double best = std::numeric_limits<double>::infinity();
  const int steps = 60;
  for (int i = 0; i <= steps; ++i)
    for (int j = 0; i + j <= steps; ++j) {
      const double u = double(i) / steps, v = double(j) / steps;
      best = std::min(best, (query - ((1 - u - v) * a + u * b + v * c)).norm());
    }
  return best;
}

TrianglePoint onFace(const Mesh& mesh, const Point& query, Eigen::Index f) {
  return closestPointOnTriangle(query, mesh.vertices.row(mesh.faces(f, 0)), mesh.vertices.row(mesh.faces(f, 1)),
                                mesh.vertices.row(mesh.faces(f, 2)));
}

double bruteForceDistance(const Mesh& mesh, const Point& query) {
  double best = std::numeric_limits<double>::infinity();
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) best = std::min(best, onFace(mesh, query, f).squared_distance);
  return std::sqrt(best);
}

}  // namespace

TEST_CASE("the closest point of a triangle is known above its face, its edges and its corners") {
  const Point a(0, 0, 0), b(2, 0, 0), c(0, 2, 0);
  CHECK(closestPointOnTriangle({0.5, 0.5, 3}, a, b, c).position.isApprox(Point(0.5, 0.5, 0)));
  CHECK(closestPointOnTriangle({1, -1, 1}, a, b, c).position.isApprox(Point(1, 0, 0)));
  CHECK(closestPointOnTriangle({2, 2, 0}, a, b, c).position.isApprox(Point(1, 1, 0)));
  CHECK(closestPointOnTriangle({5, -1, 0}, a, b, c).position.isApprox(b));
  CHECK(closestPointOnTriangle({5, -1, 0}, a, b, c).squared_distance == Approx(10));
}

TEST_CASE("the closest point of a triangle beats a dense sample and lies on the triangle") {
  std::mt19937 random(3);
  for (int trial = 0; trial < 300; ++trial) {
    const Point a = randomPoint(random, 1), b = randomPoint(random, 1), c = randomPoint(random, 1);
    const Point query = randomPoint(random, 2);
    const auto found = closestPointOnTriangle(query, a, b, c);
    const double sampled = sampledDistance(query, a, b, c);
    CHECK(std::sqrt(found.squared_distance) <= sampled + 1e-12);
    CHECK(std::sqrt(found.squared_distance) >= sampled - 0.06);
    CHECK(found.barycentric.minCoeff() >= 0);
    CHECK(found.barycentric.sum() == Approx(1));
    CHECK((found.barycentric[0] * a + found.barycentric[1] * b + found.barycentric[2] * c - found.position).norm() <
          1e-12);
  }
}

TEST_CASE("a triangle without area answers with its longest edge") {
  const Point a(0, 0, 0), b(1, 0, 0), c(3, 0, 0);
  CHECK(closestPointOnTriangle({2, 1, 0}, a, b, c).position.isApprox(Point(2, 0, 0)));
  CHECK(closestPointOnTriangle({2, 1, 0}, a, a, a).squared_distance == Approx(5));
}

TEST_CASE("the hierarchy finds the same distance as brute force, near and far, also away from the origin") {
  for (const Point& centre : {Point(0, 0, 0), Point(1000, -2000, 500)}) {
    const Mesh mesh = triangleSoup(400, centre);
    const ClosestPointQuery closest(mesh.vertices, mesh.faces);
    std::mt19937 random(11);
    for (int trial = 0; trial < 500; ++trial) {
      const Point query = centre + randomPoint(random, trial % 5 == 0 ? 100 : 1.5);
      const SurfacePoint found = closest(query);
      CHECK(found.distance ==
            Approx(bruteForceDistance(mesh, query)).epsilon(1e-12).margin(1e-15 * (1 + centre.norm())));
      CHECK((found.position - query).norm() == Approx(found.distance).epsilon(1e-9).margin(1e-12));
      CHECK((onFace(mesh, query, found.face).position - found.position).norm() < 1e-9);
    }
  }
}

TEST_CASE("points on the surface are found at distance zero") {
  const Mesh mesh = triangleSoup(200, {0, 0, 0});
  CHECK(distancesToSurface(mesh.vertices, mesh.vertices, mesh.faces).maxCoeff() < 1e-15);
}

TEST_CASE("several threads may query one hierarchy and agree with one thread") {
  const Mesh mesh = triangleSoup(300, {0, 0, 0});
  const ClosestPointQuery closest(mesh.vertices, mesh.faces);
  const auto run = [&](Eigen::VectorXd& distances) {
    std::mt19937 random(5);
    for (auto& distance : distances) distance = closest(randomPoint(random, 2)).distance;
  };
  Eigen::VectorXd alone(500), one(500), two(500);
  run(alone);
  std::thread first(run, std::ref(one)), second(run, std::ref(two));
  first.join(), second.join();
  CHECK(one == alone);
  CHECK(two == alone);
}

TEST_CASE("closest points refuse a broken mesh or query by name") {
  const Mesh mesh = triangleSoup(2, {0, 0, 0});
  CHECK_THROWS_WITH(ClosestPointQuery(mesh.vertices, Faces(0, 3)), Catch::Contains("faces"));
  Faces wrong = mesh.faces;
  wrong(1, 2) = 99;
  CHECK_THROWS_WITH(ClosestPointQuery(mesh.vertices, wrong), Catch::Contains("faces[1]"));
  Vertices broken = mesh.vertices;
  broken(0, 0) = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(ClosestPointQuery(broken, mesh.faces), Catch::Contains("vertices"));
  CHECK_THROWS_AS(ClosestPointQuery(mesh.vertices, mesh.faces)(broken.row(0)), InvalidInput);
}
