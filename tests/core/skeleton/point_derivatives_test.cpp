#include "core/skeleton/point_derivatives.h"

#include <array>
#include <catch2/catch.hpp>
#include <functional>

#include "core/skeleton/joint_regressor.h"
#include "tests/support/rigs.h"

using namespace shaped;
using namespace shaped::test;

namespace {

using Place = std::function<Eigen::Vector3d(const Eigen::VectorXd&)>;

/// Column by column central differences of a point's place.
Eigen::Matrix3Xd differences(const Place& place, const Eigen::VectorXd& at, double step) {
  Eigen::Matrix3Xd columns(3, at.size());
  for (Eigen::Index i = 0; i < at.size(); ++i) {
    const auto moved = [&](double by) { return place(at + by * Eigen::VectorXd::Unit(at.size(), i)); };
    columns.col(i) = (8 * (moved(step) - moved(-step)) - (moved(2 * step) - moved(-2 * step))) / (12 * step);
  }
  return columns;
}

/// A point of the surface: shares of a face's corners.
struct Point {
  std::array<std::int32_t, 3> corners;
  std::array<double, 3> shares;

  Eigen::Vector3d on(const Vertices& surface) const {
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    for (std::size_t c = 0; c < 3; ++c) place += shares[c] * surface.row(corners[c]).transpose();
    return place;
  }
};

/// Some, inside of faces and on vertices.
std::vector<Point> pointsOf(const Faces& faces) {
  std::vector<Point> points;
  for (Eigen::Index f = 0; f < faces.rows(); f += 17) {
    points.push_back({{faces(f, 0), faces(f, 1), faces(f, 2)}, {0.2, 0.5, 0.3}});
    if (f % 2) points.back().shares = {0, 0, 1};
  }
  return points;
}

}  // namespace

TEST_CASE("derivatives of a skinned point in the pose meet central differences, at rest and far from it") {
  const auto tube = riggedTube(5);
  const auto& rig = tube.rig;
  const auto& rest = tube.mesh.vertices;
  for (const double angle : {0.0, 1e-3, 0.6, 2.8}) {
    const Eigen::VectorXd at = toVector(randomPose(rig.skeleton, angle, 3));
    const PosedSkin skin(rig.skeleton, rig.weights, rest, rig.rest_joints, poseFrom(at));
    PointDerivatives derivatives(skin);
    for (const auto& point : pointsOf(tube.mesh.topology->faces())) {
      derivatives.turnTo(point.corners, point.shares);
      Eigen::MatrixXd derivative(3, at.size());
      for (int axis = 0; axis < 3; ++axis) {
        Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(at.size());
        derivatives.poseRow(Eigen::Vector3d::Unit(axis), row);
        derivative.row(axis) = row;
      }
      const Place place = [&](const Eigen::VectorXd& pose) -> Eigen::Vector3d {
        return point.on(skinned(rig, rest, poseFrom(pose)));
      };
      CHECK((derivative - differences(place, at, 1e-3)).cwiseAbs().maxCoeff() < 1e-9);
    }
  }
}

TEST_CASE("a skinned point moves with the joints from its bones to the root alone") {
  const auto tube = riggedTube(5);
  const auto& rig = tube.rig;
  const PosedSkin skin(rig.skeleton, rig.weights, tube.mesh.vertices, rig.rest_joints, restPose(rig.skeleton));
  PointDerivatives derivatives(skin);
  std::size_t fewest = 100, most = 0;
  for (const auto& point : pointsOf(tube.mesh.topology->faces())) {
    derivatives.turnTo(point.corners, point.shares);
    std::vector<bool> moves(std::size_t(rig.skeleton.jointCount()));
    for (std::size_t c = 0; c < 3; ++c)
      for (SkinWeights::InnerIterator entry(rig.weights, point.corners[c]); entry; ++entry)
        for (auto joint = std::int32_t(entry.col()); joint >= 0 && point.shares[c] * entry.value() > 0;
             joint = rig.skeleton.parent(joint))
          moves[std::size_t(joint)] = true;
    std::vector<std::int32_t> expected;
    for (std::int32_t j = 0; j < rig.skeleton.jointCount(); ++j)
      if (moves[std::size_t(j)]) expected.push_back(j);
    CHECK(derivatives.joints() == expected);
    fewest = std::min(fewest, expected.size());
    most = std::max(most, expected.size());
  }
  CHECK(fewest < most);
}

TEST_CASE("derivatives of a skinned point in the shape meet central differences, joints following the mesh") {
  const auto tube = riggedTube(4);
  const auto& rig = tube.rig;
  const Eigen::Index count = tube.mesh.vertices.rows(), modes = 4;
  const JointRegressor regressor = clusterRegressor(rig, tube.mesh.vertices);
  const Pose pose = randomPose(rig.skeleton, 1.2, 8);
  ShapeModes shape{Eigen::MatrixXd::Random(3 * count, modes), Eigen::MatrixXd(3 * rig.skeleton.jointCount(), modes)};
  for (Eigen::Index m = 0; m < modes; ++m) {
    const Eigen::VectorXd mode = shape.vertices.col(m);
    const Vertices joints = regressor * Eigen::Map<const Vertices>(mode.data(), count, 3);
    shape.joints.col(m) = Eigen::Map<const Eigen::VectorXd>(joints.data(), joints.size());
  }
  const auto posed = [&](const Eigen::VectorXd& coefficients) {
    const Eigen::VectorXd offset = shape.vertices * coefficients;
    const Vertices body = tube.mesh.vertices + Eigen::Map<const Vertices>(offset.data(), count, 3);
    return PosedSkin(rig.skeleton, rig.weights, body, regressor * body, pose);
  };
  const Eigen::VectorXd at = 0.1 * Eigen::VectorXd::Ones(modes);
  const PosedSkin skin = posed(at);
  PointDerivatives derivatives(skin, shape);
  for (const auto& point : pointsOf(tube.mesh.topology->faces())) {
    derivatives.turnTo(point.corners, point.shares);
    Eigen::MatrixXd derivative(3, modes);
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::RowVectorXd row(modes);
      derivatives.shapeRow(Eigen::Vector3d::Unit(axis), row);
      derivative.row(axis) = row;
    }
    const Place place = [&](const Eigen::VectorXd& x) -> Eigen::Vector3d { return point.on(posed(x).vertices()); };
    CHECK((derivative - differences(place, at, 1e-2)).cwiseAbs().maxCoeff() < 1e-10);
    CHECK(derivative.norm() > 0.1);
  }
}
