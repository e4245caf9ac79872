#include "core/body/posture.h"

#include <Eigen/LU>
#include <Eigen/SVD>

#include "core/mesh/alignment.h"
#include "core/numerics/error.h"
#include "core/numerics/scalar_cholesky.h"
#include "core/skeleton/rotation.h"
#include "core/surface/laplacian.h"
#include "core/surface/turned_edges.h"

namespace shaped {
namespace {

/// Bones with less than this share of a body's vertices have no turn of their own: a few vertices tell no rotation.
constexpr double kLeastBone = 5e-4;

void requireShape(const PostureTemplate& reference, const Vertices& shape) {
  if (shape.rows() != reference.rest.rows())
    throw InvalidInput("shape", "has " + std::to_string(shape.rows()) + " vertices, and the template has " +
                                    std::to_string(reference.rest.rows()));
}

/// The rotation nearest to a matrix.
Eigen::Matrix3d nearestRotation(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

/// What a pose turned each vertex by, undone.
std::vector<Eigen::Matrix3d> backTurns(const Rig& rig, const PosedSkeleton& bones) {
  std::vector<Eigen::Matrix3d> turns;
  for (Eigen::Index v = 0; v < rig.weights.rows(); ++v) {
    Eigen::Matrix3d blend = Eigen::Matrix3d::Zero();
    for (SkinWeights::InnerIterator entry(rig.weights, v); entry; ++entry)
      blend += entry.value() * bones.rotations[std::size_t(entry.col())];
    turns.push_back(nearestRotation(blend).transpose());
  }
  return turns;
}

/// Means over a heat kernel about each vertex of the template: (M + t L)^-1 M, whose rows sum to 1.
class HeatMeans {
 public:
  HeatMeans(const PostureTemplate& reference, double reach)
      : areas_(lumpedAreas(reference.rest, reference.topology->faces())) {
    Eigen::SparseMatrix<double> system =
        reach * reach * cotangentStiffness(reference.rest, reference.topology->faces(), ObtuseCorners::kAsZero);
    for (Eigen::Index v = 0; v < areas_.size(); ++v) system.coeffRef(v, v) += areas_[v];
    system.makeCompressed();
    if (!factor_.compute(system)) throw InvalidInput("template", "has vertices without area around them");
  }
  Eigen::MatrixXd operator()(const Eigen::MatrixXd& values) const {
    return factor_.solve(areas_.asDiagonal() * values);
  }

 private:
  Eigen::VectorXd areas_;
  ScalarCholesky factor_;
};

/// The rotations that carry each neighbourhood of the shape nearest to the template's.
std::vector<Eigen::Matrix3d> neighbourhoodTurns(const PostureTemplate& reference, const Vertices& shape, double reach) {
  const Vertices& rest = reference.rest;
  Eigen::MatrixXd moments(shape.rows(), 15);
  moments << shape, rest, Eigen::MatrixXd::Zero(shape.rows(), 9);
  for (Eigen::Index v = 0; v < shape.rows(); ++v)
    for (int a = 0; a < 3; ++a) moments.block<1, 3>(v, 6 + 3 * a) = shape(v, a) * rest.row(v);
  const Eigen::MatrixXd means = HeatMeans(reference, reach)(moments);
  std::vector<Eigen::Matrix3d> turns;
  for (Eigen::Index v = 0; v < shape.rows(); ++v) {
    Eigen::Matrix3d covariance;  // of rest (rows) with shape (columns): its nearest rotation carries shape to rest
    for (int a = 0; a < 3; ++a)
      covariance.col(a) = (means.block<1, 3>(v, 6 + 3 * a) - means(v, a) * means.block<1, 3>(v, 3)).transpose();
    turns.push_back(nearestRotation(covariance));
  }
  return turns;
}

}  // namespace

Pose estimatePose(const PostureTemplate& reference, const Vertices& shape) {
  requireShape(reference, shape);
  const auto& [skeleton, rest_joints, weights, limits] = reference.rig;
  const Eigen::SparseMatrix<double> by_bone = weights;
  Pose pose = restPose(skeleton);
  std::vector<Eigen::Matrix3d> turns;
  for (std::int32_t j = 0; j < skeleton.jointCount(); ++j) {
    const Eigen::VectorXd shares = Eigen::VectorXd(by_bone.col(j)).cwiseAbs2();
    const Eigen::Matrix3d carrier = j == 0 ? Eigen::Matrix3d::Identity() : turns[std::size_t(skeleton.parent(j))];
    const bool tells = shares.sum() >= kLeastBone * double(shape.rows());
    turns.push_back(tells ? alignRigidly(reference.rest, shape, shares).rotation : carrier);
    pose.rotations.row(j) = axisAngle(carrier.transpose() * turns.back()).transpose();
  }
  pose.translation = ((reference.regressor * shape).row(0) - rest_joints.row(0)).transpose();
  return pose;
}

Vertices normalisedPosture(const PostureTemplate& reference, const Vertices& shape, PostureNormalisation how,
                           double reach) {
  requireShape(reference, shape);
  const Vertices moved = apply(alignRigidly(shape, reference.rest), shape);
  if (how == PostureNormalisation::kNone) return moved;
  if (how == PostureNormalisation::kLocal)
    return turnedEdges(*reference.topology, moved, neighbourhoodTurns(reference, moved, reach), moved);
  const Pose pose = estimatePose(reference, moved);
  const auto bones = poseSkeleton(reference.rig.skeleton, reference.regressor * moved, pose);
  return turnedEdges(*reference.topology, moved, backTurns(reference.rig, bones), moved);
}

}  // namespace shaped
