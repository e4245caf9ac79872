#include "core/registration/bone_turns.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "core/registration/rotation_cover.h"

using namespace shaped;

TEST_CASE("turns of a bone tilt it by the angles asked for, evenly about it, after each twist") {
  const double degree = std::numbers::pi / 180;
  const Eigen::Vector3d bone(0.2, -1, 0.4), axis = bone.normalized();
  const auto turns = boneTurns(bone, {30, 60}, {0, 90});
  REQUIRE(turns.size() == 2 * (1 + 2 * 8));
  CHECK(turns[0].isIdentity(1e-12));
  CHECK(angleBetween(turns[17], Eigen::Matrix3d::Identity()) == Approx(90 * degree));
  CHECK((turns[17] * axis - axis).norm() < 1e-12);
  for (const int twist : {0, 17}) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int i = 1; i <= 16; ++i) {
      const Eigen::Vector3d tilted = turns[std::size_t(twist + i)] * axis;
      CHECK(std::acos(tilted.dot(axis)) == Approx((i <= 8 ? 30 : 60) * degree));
      if (i <= 8) sum += tilted;
    }
    CHECK((sum / 8 - std::cos(30 * degree) * axis).norm() < 1e-12);
  }
}
