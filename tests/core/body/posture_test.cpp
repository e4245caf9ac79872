#include "core/body/posture.h"

#include <catch2/catch.hpp>

#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/skeleton/rotation.h"
#include "core/surface/turned_edges.h"
#include "tests/support/bodies.h"

using namespace shaped;
using namespace shaped::test;

namespace {

double distanceAligned(const Vertices& shape, const Vertices& to) {
  return rmsVertexDistance(apply(alignRigidly(shape, to), shape), to);
}

}  // namespace

TEST_CASE("turned edges: one rotation for all turns the shape, the identity leaves it") {
  const auto mesh = icosphere(2);
  const std::size_t n = std::size_t(mesh.vertices.rows());
  const Eigen::Matrix3d turn = rotationMatrix({0.4, 1, -0.2});
  CHECK(maxVertexDistance(turnedEdges(*mesh.topology, mesh.vertices, std::vector(n, Eigen::Matrix3d::Identity().eval()),
                                      mesh.vertices),
                          mesh.vertices) < 1e-12);
  const Vertices expected = (mesh.vertices * turn.transpose()).rowwise() + Eigen::RowVector3d(1, 2, 3);
  CHECK(maxVertexDistance(turnedEdges(*mesh.topology, mesh.vertices, std::vector(n, turn), expected), expected) <
        1e-12);
}

TEST_CASE("turned edges are the minimum of their energy") {
  const auto mesh = tube(8, 6);
  std::vector<Eigen::Matrix3d> turns;
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v)
    turns.push_back(rotationMatrix({0, 0, 0.5 * mesh.vertices(v, 0)}));
  const Vertices best = turnedEdges(*mesh.topology, mesh.vertices, turns, mesh.vertices);
  // Literal: corner by corner, cotangent by cotangent.
  const auto energy = [&](const Vertices& y) {
    double sum = 0;
    const auto& faces = mesh.topology->faces();
    for (Eigen::Index f = 0; f < faces.rows(); ++f)
      for (int c = 0; c < 3; ++c) {
        const int at = faces(f, c), i = faces(f, (c + 1) % 3), j = faces(f, (c + 2) % 3);
        const Eigen::Vector3d a = (mesh.vertices.row(i) - mesh.vertices.row(at)).transpose();
        const Eigen::Vector3d b = (mesh.vertices.row(j) - mesh.vertices.row(at)).transpose();
        const double cotangent = a.dot(b) / crossMatrix(a).operator*(b).norm();
        const Eigen::Matrix3d turn = 0.5 * (turns[std::size_t(i)] + turns[std::size_t(j)]);
        const Eigen::Vector3d edge = turn * (mesh.vertices.row(i) - mesh.vertices.row(j)).transpose();
        sum += 0.5 * cotangent * ((y.row(i) - y.row(j)).transpose() - edge).squaredNorm();
      }
    return sum;
  };
  const double least = energy(best);
  CHECK(least > 1e-6);
  for (unsigned seed = 0; seed < 5; ++seed) {
    const Vertices d = jitter(best, 1e-3, seed) - best;
    CHECK(energy(best + d) > least);
    CHECK(std::abs(energy(best + d) - energy(best - d)) < 1e-11);  // no slope
  }
}

TEST_CASE("the pose of a posed template is found exactly") {
  const auto reference = tubeTemplate(5);
  Pose pose = randomPose(reference.rig.skeleton, 0.5, 2);
  // Skinned rigidly, each vertex by its foremost bone: then every bone's turn is exact.
  Rig rigid = reference.rig;
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index v = 0; v < reference.rest.rows(); ++v) {
    Eigen::Index foremost;
    Eigen::VectorXd(rigid.weights.row(v)).maxCoeff(&foremost);
    entries.emplace_back(v, foremost, 1);
  }
  rigid.weights.setZero();
  rigid.weights.setFromTriplets(entries.begin(), entries.end());
  PostureTemplate sharp = reference;
  sharp.rig = rigid;
  const auto found = estimatePose(sharp, skinned(rigid, reference.rest, pose));
  const auto want = poseSkeleton(rigid.skeleton, rigid.rest_joints, pose);
  const auto have = poseSkeleton(rigid.skeleton, rigid.rest_joints, found);
  for (std::size_t j = 0; j < want.rotations.size(); ++j) {
    if (rigid.weights.col(Eigen::Index(j)).sum() == 0) continue;
    CHECK((want.rotations[j] - have.rotations[j]).norm() < 1e-9);
  }
}

TEST_CASE("both ways of normalising the posture take most of it out, and leave a body at rest alone") {
  const auto reference = tubeTemplate(5);
  const Vertices person = tubeIdentities(reference, 1, 3).front();
  Rig rig = reference.rig;
  rig.rest_joints = reference.regressor * person;
  for (const auto how : {PostureNormalisation::kSkeleton, PostureNormalisation::kLocal}) {
    for (unsigned seed = 0; seed < 4; ++seed) {
      const Vertices posed = skinned(rig, person, randomPose(rig.skeleton, 0.25, seed));
      const double before = distanceAligned(posed, person);
      const double after = distanceAligned(normalisedPosture(reference, posed, how, 0.3), person);
      CHECK(before > 0.03);
      CHECK(after < 0.35 * before);
    }
    CHECK(distanceAligned(normalisedPosture(reference, reference.rest, how, 0.3), reference.rest) < 1e-9);
    CHECK(distanceAligned(normalisedPosture(reference, person, how, 0.3), person) < 0.02);
  }
}

TEST_CASE("a normalised posture does not depend on where the body stands") {
  const auto reference = tubeTemplate(4);
  const Vertices posed = skinned(reference.rig, reference.rest, randomPose(reference.rig.skeleton, 0.3, 1));
  for (const auto how : {PostureNormalisation::kNone, PostureNormalisation::kSkeleton, PostureNormalisation::kLocal})
    CHECK(maxVertexDistance(normalisedPosture(reference, posed, how),
                            normalisedPosture(reference, moveRigidly(posed, 4), how)) < 1e-9);
  CHECK_THROWS_WITH(normalisedPosture(reference, posed.topRows(3), PostureNormalisation::kLocal),
                    Catch::Contains("shape: has 3 vertices"));
}
