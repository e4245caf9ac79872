#include "core/shell/face_element.h"

#include <Eigen/Eigenvalues>
#include <catch2/catch.hpp>
#include <random>

using namespace shaped;

namespace {

using Matrix9 = Eigen::Matrix<double, 9, 9>;

Matrix9 dense(const FaceElement& element) {
  Matrix9 result;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto at = static_cast<Eigen::Index>(3 * i);
    result.block<3, 3>(at, at) = element.diagonal(i);
  }
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::Index row = 3 * ((k + 2) % 3), column = 3 * ((k + 1) % 3);
    const auto& block = element.between[static_cast<std::size_t>(k)];
    result.block<3, 3>(row, column) = block;
    result.block<3, 3>(column, row) = block.transpose();
  }
  return result;
}

struct Random {
  std::mt19937 engine;
  double operator()() { return std::normal_distribution<double>()(engine); }
};

}  // namespace

TEST_CASE("a triangle's element is projected to the nearest positive semi-definite one") {
  const Faces faces = (Faces(1, 3) << 0, 1, 2).finished();
  int indefinite = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    Random random{std::mt19937(seed)};
    Vertices shape(3, 3);
    for (auto& x : shape.reshaped()) x = random();
    FaceCurvature curvature;
    for (auto& x : curvature.length) x = random();
    for (auto& x : curvature.weight) x = random();
    const FaceGeometry face(faces, 0, shape);
    auto element = lengthElement(face, curvature);
    const Matrix9 before = dense(element);
    const Eigen::SelfAdjointEigenSolver<Matrix9> eigen(before);
    const auto& vectors = eigen.eigenvectors();
    const Matrix9 nearest = vectors * eigen.eigenvalues().cwiseMax(0).asDiagonal() * vectors.transpose();
    indefinite += eigen.eigenvalues()[0] < -1e-3 && eigen.eigenvalues()[8] > 1e-3;
    projectToPositive(face, element);
    CHECK((dense(element) - nearest).norm() < 1e-12 * before.norm());
  }
  CHECK(indefinite > 10);  // otherwise the projection had nothing to do
}
