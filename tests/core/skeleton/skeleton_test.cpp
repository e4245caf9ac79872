#include "core/skeleton/skeleton.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <limits>
#include <numbers>

#include "core/numerics/error.h"
#include "core/skeleton/pose.h"
#include "core/skeleton/rotation.h"
#include "tests/support/rigs.h"

using namespace shaped;
using namespace shaped::test;

TEST_CASE("a skeleton is a tree with its root first") {
  const Skeleton skeleton({{"hips", -1}, {"spine", 0}, {"leg", 0}});
  CHECK(skeleton.jointCount() == 3);
  CHECK(skeleton.find("leg") == 2);
  CHECK_FALSE(skeleton.find("tail"));
  CHECK_THROWS_WITH(Skeleton({}), Catch::Contains("joints: is empty"));
  CHECK_THROWS_WITH(Skeleton({{"a", 0}}), Catch::Contains("joints[0]: has parent 0, want -1"));
  CHECK_THROWS_WITH(Skeleton({{"a", -1}, {"b", -1}}), Catch::Contains("joints[1]: has parent -1, want 0 to 0"));
  CHECK_THROWS_WITH(Skeleton({{"a", -1}, {"b", 2}, {"c", 0}}), Catch::Contains("joints[1]: has parent 2"));
  CHECK_THROWS_WITH(Skeleton({{"a", -1}, {"a", 0}}), Catch::Contains("joints[1]: repeats the name \"a\""));
  CHECK_THROWS_WITH(Skeleton({{"", -1}}), Catch::Contains("joints[0]: has no name"));
}

TEST_CASE("rotations agree with Eigen's, whatever the angle") {
  for (const double angle : {0.0, 1e-9, 1e-5, 9e-3, 1.1e-2, 0.5, 2.0, 3.1415, 4.0}) {
    const Eigen::Vector3d axis = Eigen::Vector3d(1, -2, 0.5).normalized();
    const Eigen::Matrix3d rotation = rotationMatrix(angle * axis);
    CHECK((rotation - Eigen::AngleAxisd(angle, axis).toRotationMatrix()).norm() < 1e-14);
    const double turn = angle <= std::numbers::pi ? angle : angle - 2 * std::numbers::pi;
    CHECK((axisAngle(rotation) - turn * axis).norm() < 1e-12);
  }
  CHECK(axisAngle(rotationMatrix({0, std::numbers::pi, 0})).norm() == Approx(std::numbers::pi));
}

TEST_CASE("the left Jacobian tells how a rotation turns, whatever the angle") {
  for (const double angle : {0.0, 1e-6, 9e-3, 1.1e-2, 0.7, 3.0}) {
    const Eigen::Vector3d w = angle * Eigen::Vector3d(0.6, 0, -0.8);
    Eigen::Matrix3d differences;
    const double step = 1e-5;
    for (int c = 0; c < 3; ++c) {
      const Eigen::Vector3d d = step * Eigen::Vector3d::Unit(c);
      differences.col(c) = (axisAngle(rotationMatrix(w + d) * rotationMatrix(w).transpose()) -
                            axisAngle(rotationMatrix(w - d) * rotationMatrix(w).transpose())) /
                           (2 * step);
    }
    CHECK((leftJacobian(w) - differences).norm() < 1e-9);
  }
}

TEST_CASE("forward kinematics: bones keep their lengths, descendants follow, the rest pose is the rest") {
  const auto tube = riggedTube(5);
  const auto& skeleton = tube.rig.skeleton;
  CHECK((poseSkeleton(skeleton, tube.rig.rest_joints, restPose(skeleton)).joints - tube.rig.rest_joints).norm() == 0);
  const auto posed = poseSkeleton(skeleton, tube.rig.rest_joints, randomPose(skeleton, 2, 1));
  for (std::int32_t j = 1; j < skeleton.jointCount(); ++j) {
    const auto length = [&](const Vertices& at) { return (at.row(j) - at.row(skeleton.parent(j))).norm(); };
    CHECK(length(posed.joints) == Approx(length(tube.rig.rest_joints)).epsilon(1e-12));
  }
  // A quarter turn of the elbow in the plane: what hangs on it stands upright, what carries it does not move.
  Pose quarter = restPose(skeleton);
  quarter.rotations.row(2) << 0, 0, std::numbers::pi / 2;
  const auto bent = poseSkeleton(skeleton, tube.rig.rest_joints, quarter);
  const Eigen::RowVector3d bone = tube.rig.rest_joints.row(4) - tube.rig.rest_joints.row(2);
  CHECK((bent.joints.row(4) - bent.joints.row(2)).isApprox(Eigen::RowVector3d(0, bone.x(), 0), 1e-12));
  CHECK((bent.joints.topRows(3) - tube.rig.rest_joints.topRows(3)).norm() == 0);
}

TEST_CASE("a pose that does not fit its skeleton is refused by name") {
  const auto tube = riggedTube(3);
  Pose pose = restPose(tube.rig.skeleton);
  pose.rotations.conservativeResize(4, 3);
  CHECK_THROWS_WITH(poseSkeleton(tube.rig.skeleton, tube.rig.rest_joints, pose),
                    Catch::Contains("pose.rotations: has 4 rows, want one for each of 5 joints"));
  pose = restPose(tube.rig.skeleton);
  pose.rotations(3, 1) = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(poseSkeleton(tube.rig.skeleton, tube.rig.rest_joints, pose),
                    Catch::Contains("pose.rotations[3]: is not finite"));
  pose = restPose(tube.rig.skeleton);
  pose.translation.x() = std::numeric_limits<double>::infinity();
  CHECK_THROWS_WITH(poseSkeleton(tube.rig.skeleton, tube.rig.rest_joints, pose),
                    Catch::Contains("pose.translation: is not finite"));
  CHECK_THROWS_WITH(poseSkeleton(tube.rig.skeleton, Vertices::Zero(2, 3), restPose(tube.rig.skeleton)),
                    Catch::Contains("rest_joints: has 2 rows"));
}
