#include "core/registration/fit_evidence.h"

#include <catch2/catch.hpp>

using namespace shaped;

TEST_CASE("offsets are along the normals, of points that face the same way and are near",
) {
  // A square in the plane z = 0, twice triangulated, and points above it.
  Vertices rest(4, 3);
  rest << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0;
  Faces faces(2, 3);
  faces << 0, 1, 2, 0, 2, 3;
  BodyState state{Eigen::VectorXd::Constant(1, 2.0), {}};
  state.pose.rotations = Vertices::Zero(2, 3);
  state.pose.rotations.row(1) << 0.1, 0, -0.2;
  Scan scan{rest, Vertices::Zero(4, 3), {}};
  scan.points.col(2).setConstant(0.01);
  scan.normals.col(2).setConstant(1);
  scan.normals.row(1) << 0, 0, -1;
  scan.points.row(2).z() = 0.5;
  const auto evidence = evidenceOf(state, rest, faces, scan);
  CHECK(evidence.offsets.isApprox(Eigen::Vector4d(0.01, 0, 0, 0.01)));
  CHECK(evidence.state.isApprox(Eigen::Vector4d(2, 1, 0, -2)));
}
