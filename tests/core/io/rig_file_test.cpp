#include "core/io/rig_file.h"

#include <catch2/catch.hpp>

#include "core/numerics/error.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using Catch::Contains;

namespace {

const std::string kJoints = R"({"name": "hips", "parent": null, "rest": [0, 1, 0]},
                               {"name": "knee", "parent": "hips", "rest": [0.1, 0.5, 0]})";

RigFile parse(const std::string& joints, const std::string& weights, const std::string& more = "") {
  return parseRig("r.json", "{\"joints\": [" + joints + "], \"weights\": [" + weights + "]" + more + "}", 2);
}

}  // namespace

TEST_CASE("a rig reads joints by the name or index of their parent, limits and weights a vertex") {
  const auto [rig, change] = parse(kJoints + R"(, {"name": "foot", "parent": 1, "rest": [0.1, 0, 0.05],
      "limits": {"low": [-1, 0, null], "high": [2, 0, null]}, "note": "left"})",
                                   "[[0, 1]], [[2, 0.25], [1, 0.75]]");
  CHECK(rig.skeleton.jointCount() == 3);
  CHECK(rig.skeleton.name(1) == "knee");
  CHECK(rig.skeleton.parent(0) == -1);
  CHECK(rig.skeleton.parent(1) == 0);
  CHECK(rig.skeleton.parent(2) == 1);
  CHECK(rig.rest_joints.row(2) == Eigen::RowVector3d(0.1, 0, 0.05));
  CHECK(rig.weights.coeff(0, 0) == 1);
  CHECK(rig.weights.coeff(1, 1) == 0.75);
  CHECK(rig.weights.coeff(1, 2) == 0.25);
  CHECK(rig.weights.nonZeros() == 3);
  CHECK(change == 0);
  REQUIRE(rig.limits);
  const double none = std::numeric_limits<double>::infinity();
  CHECK(rig.limits->low.row(2) == Eigen::RowVector3d(-1, 0, -none));
  CHECK(rig.limits->high.row(2) == Eigen::RowVector3d(2, 0, none));
  CHECK(rig.limits->low.row(0) == Eigen::RowVector3d::Constant(-none));
  CHECK_NOTHROW(rig.requireValid(2));
  CHECK_FALSE(parse(kJoints, "[[0, 1]], [[1, 1]]").rig.limits);
}

TEST_CASE("a rig's lengths are in its unit, and weights that do not sum to 1 are mended and told of") {
  const auto [rig, change] = parse(kJoints, "[[0, 0.5], [1, 0.4]], [[1, 1.25], [0, 0]]", R"(, "unit": "dm")");
  CHECK(rig.rest_joints(0, 1) == 0.1);
  CHECK(change == 0.25);
  CHECK(rig.weights.coeff(0, 0) == Approx(5.0 / 9).epsilon(1e-15));
  CHECK(rig.weights.coeff(1, 1) == 1);
  CHECK(rig.weights.nonZeros() == 3);  // what is 0 is not there
}

TEST_CASE("a rig reads back what was written") {
  const test::TemporaryFolder folder;
  const auto rig = parse(kJoints + R"(, {"name": "fu\u00df \"1\"", "parent": 0, "rest": [0.1, 1e-17, 0.3],
      "limits": {"low": [-0.1, 0, null], "high": [2.4, 0, 1]}})",
                         "[[0, 0.3333333333333333], [2, 0.6666666666666667]], [[1, 1]]")
                       .rig;
  writeRig(folder / "r.json", rig);
  const auto [back, change] = readRig(folder / "r.json", 2);
  CHECK(change < 1e-15);
  for (std::int32_t j = 0; j < 3; ++j) {
    CHECK(back.skeleton.name(j) == rig.skeleton.name(j));
    CHECK(back.skeleton.parent(j) == rig.skeleton.parent(j));
  }
  CHECK(back.rest_joints == rig.rest_joints);
  CHECK((back.limits->low.array() == rig.limits->low.array()).all());
  CHECK((back.limits->high.array() == rig.limits->high.array()).all());
  CHECK((back.weights - rig.weights).norm() < 1e-15);
  auto broken = rig;
  broken.weights *= 0.5;
  CHECK_THROWS_WITH(writeRig(folder / "r.json", broken), Contains("weights[0]: sums to 0.5"));
}

TEST_CASE("faulty joints are refused with the file, the joint and the reason") {
  struct Case {
    std::string joints, error;
  };
  const std::vector<Case> cases{
      {"", "has no joints"},
      {"3", "joints[0] has no name"},
      {R"({"name": "", "rest": [0, 0, 0]})", "joints[0] has no name"},
      {R"({"name": "a", "parent": 0, "rest": [0, 0, 0]})", "joints[0] ('a') has parent '0', want"},
      {R"({"name": "a", "parent": "a", "rest": [0, 0, 0]})", "joints[0] ('a') has parent '\"a\"', want"},
      {R"({"name": "a", "rest": [0, 0]})", "joints[0] ('a') needs three numbers as rest"},
      {R"({"name": "a", "rest": [0, 0, null]})", "joints[0] ('a') needs three numbers as rest"},
      {R"({"name": "a"})", "joints[0] ('a') needs three numbers as rest"},
      {kJoints + R"(, {"name": "hips", "parent": 0, "rest": [0, 0, 0]})", "joints[2] ('hips') has the name of an"},
      {kJoints + R"(, {"name": "c", "rest": [0, 0, 0]})", "joints[2] ('c') has no parent; want one root"},
      {kJoints + R"(, {"name": "c", "parent": 2, "rest": [0, 0, 0]})", "joints[2] ('c') has parent '2', want"},
      {kJoints + R"(, {"name": "c", "parent": 1.5, "rest": [0, 0, 0]})", "joints[2] ('c') has parent '1.5', want"},
      {R"({"name": "a", "rest": [0, 0, 0], "limits": 3})", "joints[0] ('a') limits needs three numbers as low"},
      {R"({"name": "a", "rest": [0, 0, 0], "limits": {"low": [0, 1, 0], "high": [0, 0, 0]}})",
       "joints[0] ('a') limits have a low above"}};
  for (const auto& [joints, error] : cases) {
    INFO(joints);
    CHECK_THROWS_AS(parse(joints, "[[0, 1]], [[0, 1]]"), InvalidInput);
    CHECK_THROWS_WITH(parse(joints, "[[0, 1]], [[0, 1]]"), Contains("r.json: " + error));
  }
  CHECK_THROWS_WITH(parse(kJoints, "[[0, 1]], [[0, 1]]", R"(, "unit": "mile")"),
                    Contains("unit is '\"mile\"'; want mm"));
  for (const std::string text : {"", "{", "[]", "{\"joints\": {}}", "\xff"})
    CHECK_THROWS_AS(parseRig("r.json", text, 2), InvalidInput);
  CHECK_THROWS_WITH(parseRig("r.json", "{\"joints\": [" + kJoints + "]}", 2), Contains("has no list 'weights'"));
}

TEST_CASE("faulty weights are refused with the file, the vertex and the reason") {
  struct Case {
    std::string weights, error;
  };
  const std::vector<Case> cases{{"", "weights has lists for 0 vertices, and the mesh has 2"},
                                {"[[0, 1]], [[0, 1]], [[0, 1]]", "weights has lists for 3 vertices"},
                                {"[[0, 1]], 3", "weights[1] must be a list of [joint, weight]"},
                                {"[[0, 1]], [0, 1]", "weights[1] must be a list of [joint, weight]"},
                                {"[[0, 1]], [[0, 1, 2]]", "weights[1] must be a list of [joint, weight]"},
                                {"[[0, 1]], [[0, null]]", "weights[1] must be a list of [joint, weight]"},
                                {"[[0, 1]], []", "weights[1] has no weight above 0"},
                                {"[[0, 1]], [[0, 0]]", "weights[1] has no weight above 0"},
                                {"[[0, 1]], [[2, 1]]", "weights[1] names joint '2', outside [0, 2)"},
                                {"[[0, 1]], [[-1, 1]]", "weights[1] names joint '-1', outside [0, 2)"},
                                {"[[0, 1]], [[18446744073709551615, 1]]", "weights[1] names joint '184467440"},
                                {"[[0, 1]], [[\"hips\", 1]]", "weights[1] names joint '\"hips\"', outside [0, 2)"},
                                {"[[0, 1]], [[0, 1], [0, 1]]", "weights[1] names joint 0 twice"},
                                {"[[0, 1]], [[0, -0.5], [1, 1]]", "weights[1] gives joint 0 the weight -0.5"},
                                {"[[0, 1]], [[0, 1e308], [1, 1e308]]", "weights[1] has weights whose sum is not"},
                                {"[[0, 1]], [[0, NaN]]", "is no JSON"},
                                {"[[0, 1]], [[0, 1e999]]", "is no JSON"}};
  for (const auto& [weights, error] : cases) {
    INFO(weights);
    CHECK_THROWS_AS(parse(kJoints, weights), InvalidInput);
    CHECK_THROWS_WITH(parse(kJoints, weights), Contains("r.json: " + error));
  }
}
