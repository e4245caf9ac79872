#include "core/reduction/subspace.h"

#include <Eigen/SVD>
#include <catch2/catch.hpp>

#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;

namespace {

std::vector<Vertices> bentPipes() {
  std::vector<Vertices> shapes;
  for (int i = 0; i < 9; ++i) shapes.push_back(jitter(bend(tube(10, 6).vertices, 0.2 * i - 0.6), 0.003, 4u + i));
  return shapes;
}

double orthonormality(const Eigen::MatrixXd& basis) {
  return (basis.transpose() * basis - Eigen::MatrixXd::Identity(basis.cols(), basis.cols())).norm();
}

}  // namespace

TEST_CASE("a principal subspace is spanned by the left singular vectors of the displacements") {
  const auto shapes = bentPipes();
  const auto& origin = shapes[3];
  Eigen::MatrixXd displacements(origin.size(), 9);
  for (int i = 0; i < 9; ++i)
    displacements.col(i) = Eigen::Map<const Eigen::VectorXd>(shapes[i].data(), origin.size()) -
                           Eigen::Map<const Eigen::VectorXd>(origin.data(), origin.size());
  const Eigen::BDCSVD<Eigen::MatrixXd> svd(displacements, Eigen::ComputeThinU);
  const auto subspace = principalSubspace(origin, shapes, 4);
  REQUIRE(subspace.dimension() == 4);
  CHECK(orthonormality(subspace.basis) < 1e-13);
  const Eigen::MatrixXd cosines = svd.matrixU().leftCols(4).transpose() * subspace.basis;
  CHECK((cosines.cwiseAbs() - Eigen::MatrixXd::Identity(4, 4)).norm() < 1e-9);
  const double second = svd.singularValues()[1] / svd.singularValues()[0];
  CHECK(principalSubspace(origin, shapes, 4, 1.01 * second).dimension() == 1);
  CHECK(principalSubspace(origin, shapes, 4, 0.99 * second).dimension() == 2);
}

TEST_CASE("a subspace of all displacements contains every shape, and has no more dimensions than they span") {
  const auto shapes = bentPipes();
  const auto whole = principalSubspace(shapes[3], shapes, 40);
  CHECK(whole.dimension() == 8);  // the origin is one of them
  CHECK(orthonormality(whole.basis) < 1e-12);
  for (const auto& shape : shapes) CHECK((whole.shape(whole.coordinates(shape)) - shape).norm() < 1e-10);
  CHECK(principalSubspace(shapes[3], {shapes[3], shapes[3]}, 5).dimension() == 0);
}

TEST_CASE("the missing vector makes a subspace contain one shape more") {
  const auto shapes = bentPipes();
  const auto small = principalSubspace(shapes[3], shapes, 2);
  CHECK((small.shape(small.coordinates(shapes[8])) - shapes[8]).norm() > 1e-3);
  const auto with = including(small, shapes[8]);
  CHECK(with.dimension() == 3);
  CHECK(orthonormality(with.basis) < 1e-13);
  CHECK(with.basis.leftCols(2) == small.basis);
  CHECK((with.shape(with.coordinates(shapes[8])) - shapes[8]).norm() < 1e-12);
  CHECK(including(with, shapes[8]).dimension() == 3);
}

TEST_CASE("the central shape is the one in the middle, wherever each of them stands") {
  std::vector<Vertices> shapes;
  for (const double angle : {0.9, 0.1, 0.5, 0.42, 0.0}) shapes.push_back(bend(tube(10, 6).vertices, angle));
  CHECK(centralShape(shapes) == 3);
  for (std::size_t i = 0; i < shapes.size(); ++i) shapes[i] = moveRigidly(shapes[i], static_cast<unsigned>(i));
  CHECK(centralShape(shapes) == 3);
}
