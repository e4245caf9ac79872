#include "tests/support/shapes.h"

#include <Eigen/Geometry>
#include <map>
#include <vector>

namespace shaped::test {
namespace {

constexpr double kPi = 3.14159265358979323846;

Mesh makeMesh(const std::vector<Eigen::Vector3d>& points, const std::vector<std::array<int, 3>>& triangles) {
  Vertices vertices(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t v = 0; v < points.size(); ++v) vertices.row(static_cast<Eigen::Index>(v)) = points[v];
  Faces faces(static_cast<Eigen::Index>(triangles.size()), 3);
  for (std::size_t f = 0; f < triangles.size(); ++f)
    faces.row(static_cast<Eigen::Index>(f)) << triangles[f][0], triangles[f][1], triangles[f][2];
  return {std::make_shared<Topology>(static_cast<std::int32_t>(points.size()), faces), vertices};
}

}  // namespace

Mesh icosphere(int levels) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  std::vector<Eigen::Vector3d> points{{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                                      {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  for (auto& p : points) p.normalize();
  std::vector<std::array<int, 3>> faces{{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                        {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                        {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                        {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<int, int>, int> middle;
    const auto mid = [&](int a, int b) {
      const auto [it, fresh] = middle.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<int>(points.size()));
      if (fresh)
        points.push_back((points[static_cast<std::size_t>(a)] + points[static_cast<std::size_t>(b)]).normalized());
      return it->second;
    };
    std::vector<std::array<int, 3>> finer;
    for (const auto& [a, b, c] : faces) {
      const int ab = mid(a, b), bc = mid(b, c), ca = mid(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    faces = std::move(finer);
  }
  return makeMesh(points, faces);
}

Mesh grid(int n) {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<int, 3>> faces;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) points.emplace_back(i / (n - 1.0), j / (n - 1.0), 0);
  for (int j = 0; j + 1 < n; ++j)
    for (int i = 0; i + 1 < n; ++i) {
      const int a = j * n + i, b = a + 1, c = a + n, d = c + 1;
      faces.push_back({a, b, d});
      faces.push_back({a, d, c});
    }
  return makeMesh(points, faces);
}

Mesh tube(int rings, int sides) {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<int, 3>> faces;
  for (int r = 0; r < rings; ++r)
    for (int s = 0; s < sides; ++s) {
      const double angle = 2 * kPi * (s + 0.5 * (r % 2)) / sides;
      points.emplace_back(4.0 * r / (rings - 1) - 2, 0.5 * std::cos(angle), 0.5 * std::sin(angle));
    }
  points.emplace_back(-2.2, 0, 0);
  points.emplace_back(2.2, 0, 0);
  const int left = rings * sides, right = left + 1;
  for (int s = 0; s < sides; ++s) {
    const int t = (s + 1) % sides;
    for (int r = 0; r + 1 < rings; ++r) {
      const int a = r * sides + s, b = r * sides + t, c = a + sides, d = b + sides;
      if (r % 2 == 0) {
        faces.push_back({a, b, c});
        faces.push_back({b, d, c});
      } else {
        faces.push_back({a, b, d});
        faces.push_back({a, d, c});
      }
    }
    faces.push_back({left, t, s});
    const int last = (rings - 1) * sides;
    faces.push_back({right, last + s, last + t});
  }
  return makeMesh(points, faces);
}

Vertices jitter(const Vertices& shape, double amount, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-amount, amount);
  return shape.unaryExpr([&](double x) { return x + uniform(random); });
}

Vertices bend(const Vertices& shape, double angle) {
  if (angle == 0) return shape;
  const double length = shape.col(0).maxCoeff() - shape.col(0).minCoeff();
  const double radius = length / angle;
  Vertices bent(shape.rows(), 3);
  for (Eigen::Index v = 0; v < shape.rows(); ++v) {
    const double turn = shape(v, 0) / radius, out = radius - shape(v, 1);
    bent.row(v) << out * std::sin(turn), radius - out * std::cos(turn), shape(v, 2);
  }
  return bent;
}

Vertices moveRigidly(const Vertices& shape, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto number = [&] { return normal(random); };
  const Eigen::Quaterniond turn = Eigen::Quaterniond(number(), number(), number(), number()).normalized();
  const Eigen::RowVector3d shift(number(), number(), number());
  return (shape * turn.toRotationMatrix().transpose()).rowwise() + shift;
}

}  // namespace shaped::test
