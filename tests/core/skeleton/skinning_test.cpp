#include "core/skeleton/skinning.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <numbers>

#include "core/numerics/error.h"
#include "core/skeleton/joint_reach.h"
#include "core/skeleton/joint_regressor.h"
#include "core/skeleton/rotation.h"
#include "tests/support/rigs.h"

using namespace shaped;
using namespace shaped::test;

namespace {

/// Skinning by homogeneous matrices multiplied down each chain, one vertex at a time.
Vertices literalSkinning(const Rig& rig, const Vertices& rest, const Pose& pose) {
  const auto transform = [&](std::int32_t joint) {
    Eigen::Matrix4d product = Eigen::Matrix4d::Identity();
    for (; joint >= 0; joint = rig.skeleton.parent(joint)) {
      Eigen::Matrix4d about = Eigen::Matrix4d::Identity();
      const Eigen::Vector3d centre = rig.rest_joints.row(joint).transpose();
      about.topLeftCorner<3, 3>() = rotationMatrix(pose.rotations.row(joint).transpose());
      about.topRightCorner<3, 1>() = centre - about.topLeftCorner<3, 3>() * centre;
      if (joint == 0) about.topRightCorner<3, 1>() += pose.translation;
      product = about * product;
    }
    return product;
  };
  Vertices posed = Vertices::Zero(rest.rows(), 3);
  for (Eigen::Index v = 0; v < rest.rows(); ++v)
    for (std::int32_t j = 0; j < rig.skeleton.jointCount(); ++j)
      posed.row(v) +=
          rig.weights.coeff(v, j) * (transform(j) * rest.row(v).transpose().homogeneous()).head<3>().transpose();
  return posed;
}

}  // namespace

TEST_CASE("linear blend skinning agrees with products of homogeneous matrices") {
  const auto tube = riggedTube(5);
  for (unsigned seed = 0; seed < 5; ++seed) {
    const Pose pose = randomPose(tube.rig.skeleton, 2.5, seed);
    const Vertices posed = skinned(tube.rig, tube.mesh.vertices, pose);
    CHECK((posed - literalSkinning(tube.rig, tube.mesh.vertices, pose)).cwiseAbs().maxCoeff() < 1e-13);
  }
  CHECK((skinned(tube.rig, tube.mesh.vertices, restPose(tube.rig.skeleton)) - tube.mesh.vertices).norm() < 1e-13);
}

TEST_CASE("a joint reaches as far as what it and the joints below it carry") {
  // A chain of three, a metre apart, and a fourth on the second that carries nothing.
  const Skeleton skeleton({{"a", -1}, {"b", 0}, {"c", 1}, {"d", 1}});
  Vertices joints(4, 3), rest(3, 3);
  joints << 0, 0, 0, 1, 0, 0, 2, 0, 0, 1, 1, 0;
  rest << 0.5, 0, 0, 1, 0.2, 0, 4, 0, 0;
  SkinWeights weights(3, 4);
  weights.insert(0, 0) = 0.4;
  weights.insert(0, 1) = 0.6;
  weights.insert(1, 1) = 1;
  weights.insert(2, 2) = 0.9;
  weights.insert(2, 3) = 0.1;
  weights.makeCompressed();
  CHECK(jointReach(skeleton, weights, rest, joints) == std::vector<double>{4, 3, 2, 0});
}

TEST_CASE("the root's transform moves a body rigidly") {
  const auto tube = riggedTube(4);
  Pose pose = restPose(tube.rig.skeleton);
  pose.rotations.row(0) << 0.3, -1, 0.4;
  pose.translation << 1, 2, 3;
  const Vertices posed = skinned(tube.rig, tube.mesh.vertices, pose);
  const Eigen::Matrix3d turn = rotationMatrix({0.3, -1, 0.4});
  const Eigen::RowVector3d root = tube.rig.rest_joints.row(0);
  const Vertices expected =
      ((tube.mesh.vertices.rowwise() - root) * turn.transpose()).rowwise() + (root + Eigen::RowVector3d(1, 2, 3));
  CHECK((posed - expected).cwiseAbs().maxCoeff() < 1e-13);
}

TEST_CASE("unskinning undoes skinning, and says where it cannot") {
  const auto tube = riggedTube(5);
  const auto& rig = tube.rig;
  Pose pose = randomPose(rig.skeleton, 1, 4);
  const Vertices posed = skinned(rig, tube.mesh.vertices, pose);
  CHECK(
      (unskinned(rig.skeleton, rig.weights, posed, rig.rest_joints, pose) - tube.mesh.vertices).cwiseAbs().maxCoeff() <
      1e-11);
  Rig halves = rig;
  std::vector<Eigen::Triplet<double>> entries;
  for (int v = 0; v < posed.rows(); ++v) {
    entries.emplace_back(v, 1, 0.5);
    entries.emplace_back(v, 2, 0.5);
  }
  halves.weights.setZero();
  halves.weights.setFromTriplets(entries.begin(), entries.end());
  pose = restPose(rig.skeleton);
  pose.rotations.row(2) << std::numbers::pi, 0, 0;
  CHECK_THROWS_WITH(unskinned(rig.skeleton, halves.weights, posed, rig.rest_joints, pose),
                    Catch::Contains("leaves vertex 0 no way back"));
}

TEST_CASE("weights are normalised, and refused where they cannot be") {
  SkinWeights raw(3, 2);
  raw.insert(0, 0) = 0.5;
  raw.insert(0, 1) = 0.4;
  raw.insert(1, 1) = 2;
  raw.insert(2, 0) = 1;
  const auto normalised = normaliseWeights(raw);
  CHECK(normalised.largest_change == Approx(1));
  CHECK(normalised.weights.coeff(0, 0) == Approx(5.0 / 9));
  CHECK(normalised.weights.coeff(1, 1) == 1);
  raw.coeffRef(1, 1) = 0;
  CHECK_THROWS_WITH(normaliseWeights(raw), Catch::Contains("weights[1]: are all zero"));
  raw.coeffRef(1, 1) = -0.1;
  CHECK_THROWS_WITH(normaliseWeights(raw), Catch::Contains("weights[1]: gives joint 1 the weight -0.1"));
}

TEST_CASE("a rig that does not fit its mesh is refused by name") {
  auto rig = riggedTube(3).rig;
  const auto vertices = std::int32_t(rig.weights.rows());
  rig.requireValid(vertices);
  CHECK_THROWS_WITH(rig.requireValid(7), Catch::Contains("weights: is for") && Catch::Contains("the mesh has 7"));
  Rig heavy = rig;
  heavy.weights *= 1.01;
  CHECK_THROWS_WITH(heavy.requireValid(vertices), Catch::Contains("weights[0]: sums to 1.01"));
  rig.limits = JointLimits{Vertices::Constant(5, 3, -1), Vertices::Constant(5, 3, 1)};
  rig.requireValid(vertices);
  rig.limits->low(2, 1) = 2;
  CHECK_THROWS_WITH(rig.requireValid(vertices), Catch::Contains("limits[2]: has a lower limit above"));
}

TEST_CASE("the cluster regressor gives the rig's joints and follows affine motions") {
  const auto tube = riggedTube(5);
  const auto regressor = clusterRegressor(tube.rig, tube.mesh.vertices);
  CHECK((regressor * tube.mesh.vertices - tube.rig.rest_joints).cwiseAbs().maxCoeff() < 1e-12);
  Eigen::Matrix3d map;
  map << 1, 0.2, 0, 0, 1.5, 0.1, -0.3, 0, 0.8;
  const Eigen::RowVector3d shift(1, 2, 3);
  const Vertices moved = (tube.mesh.vertices * map.transpose()).rowwise() + shift;
  const Vertices expected = (tube.rig.rest_joints * map.transpose()).rowwise() + shift;
  CHECK((regressor * moved - expected).cwiseAbs().maxCoeff() < 1e-12);
  // Local: a joint listens to its own neighbourhood.
  Vertices far = tube.mesh.vertices;
  for (Eigen::Index v = 0; v < far.rows(); ++v)
    if (tube.rig.weights.coeff(v, 0) == 0 && tube.rig.weights.coeff(v, 1) == 0) far.row(v).array() += 10;
  CHECK(((regressor * far).row(1) - tube.rig.rest_joints.row(1)).norm() < 1e-12);
}
