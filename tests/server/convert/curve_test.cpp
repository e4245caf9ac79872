#include "server/convert/curve.h"

#include <catch2/catch.hpp>
#include <limits>

#include "core/numerics/error.h"

using namespace shaped;
using namespace shaped::server;
using Catch::Contains;

TEST_CASE("flow options have the defaults of the message's comments") {
  const v1::FlowOptions message;
  const auto small = smoothingFromProto(message, 1000, 10, "flow"),
             large = smoothingFromProto(message, 1001, 50, "flow");
  CHECK(small.steps == 10);
  CHECK(large.steps == 50);
  CHECK_FALSE(small.reduced);
  CHECK(large.reduced);
  CHECK(small.flow.tau == 0.5);
  CHECK(small.flow.control);
  CHECK(small.reduction.dimension == 15);
  CHECK(small.reduction.ghost_vertices == 1250);
}

TEST_CASE("flow options out of range are refused with their path") {
  const auto refuse = [](const auto& change, const std::string& text) {
    v1::FlowOptions message;
    change(message);
    CHECK_THROWS_WITH(smoothingFromProto(message, 100, 10, "flow"), Contains(text));
  };
  refuse([](auto& m) { m.set_steps(10'001); }, "flow.steps: = 10001");
  refuse([](auto& m) { m.set_tau(0); }, "flow.tau: = 0");
  refuse([](auto& m) { m.set_tau(std::numeric_limits<double>::quiet_NaN()); }, "flow.tau");
  refuse([](auto& m) { m.set_dimension(501); }, "flow.dimension");
  refuse([](auto& m) { m.set_ghost_vertices(3); }, "flow.ghost_vertices: = 3");
  refuse([](auto& m) { m.set_ghost_vertices(4'000'000'000U); }, "flow.ghost_vertices");
  refuse([](auto& m) { m.set_reduction(static_cast<v1::CurveReduction>(9)); }, "flow.reduction: = 9");
  v1::FlowOptions none;
  none.set_steps(0);
  CHECK(smoothingFromProto(none, 100, 10, "flow").steps == 0);
}

TEST_CASE("geodesic options out of range are refused with their path") {
  v1::GeodesicOptions message;
  CHECK(geodesicFromProto(message, "options").enrichments == 2);
  CHECK(geodesicFromProto(message, "options").solver == PathSolver::kNewton);
  message.set_enrichments(0);
  CHECK(geodesicFromProto(message, "options").enrichments == 0);
  message.set_enrichments(51);
  CHECK_THROWS_WITH(geodesicFromProto(message, "options"), Contains("options.enrichments: = 51"));
  message.clear_enrichments();
  for (const double tolerance : {-1.0, 1.0, std::numeric_limits<double>::quiet_NaN()}) {
    message.set_tolerance(tolerance);
    CHECK_THROWS_WITH(geodesicFromProto(message, "options"), Contains("options.tolerance"));
  }
}

TEST_CASE("restoring forces are one for all frames or one for each") {
  google::protobuf::RepeatedField<double> restore;
  CHECK(restoreFromProto(restore, 3).empty());
  restore.Add(0);
  CHECK(restoreFromProto(restore, 3).empty());
  restore.Set(0, 0.25);
  CHECK(restoreFromProto(restore, 3) == std::vector<double>{0.25, 0.25, 0.25});
  restore.Add(1);
  CHECK_THROWS_WITH(restoreFromProto(restore, 3), Contains("restore: has 2 numbers"));
  CHECK(restoreFromProto(restore, 2) == std::vector<double>{0.25, 1});
  restore.Set(1, 1.01);
  CHECK_THROWS_WITH(restoreFromProto(restore, 2), Contains("restore[1]"));
}

TEST_CASE("held frames and the upward direction are checked") {
  google::protobuf::RepeatedField<std::uint32_t> held;
  CHECK(heldFromProto(held, 3).empty());
  held.Add(2);
  CHECK(heldFromProto(held, 3) == std::vector<bool>{false, false, true});
  held.Add(3);
  CHECK_THROWS_WITH(heldFromProto(held, 3), Contains("held[1]: = 3, but there are 3 frames"));
  google::protobuf::RepeatedField<double> up;
  CHECK_FALSE(upFromProto(up).has_value());
  for (const double x : {0.0, 1.0, 0.0}) up.Add(x);
  CHECK(*upFromProto(up) == Eigen::Vector3d::UnitY());
  up.Set(1, 0);
  CHECK_THROWS_WITH(upFromProto(up), Contains("up: is no direction"));
  up.RemoveLast();
  CHECK_THROWS_WITH(upFromProto(up), Contains("up: has 2 numbers"));
}

TEST_CASE("curves that would take too much memory are refused with what would fit") {
  Limits limits;
  limits.curve_bytes = 24 * 100 * 50;
  CHECK_NOTHROW(requireCurveFits(50, 100, limits, "frames"));
  CHECK_THROWS_WITH(requireCurveFits(51, 100, limits, "frames"), Contains("at most 50 frames fit"));
  CHECK_THROWS_WITH(requireCurveFits(std::numeric_limits<std::uint32_t>::max(), 2'000'000, Limits(), "frames"),
                    Contains("--max-curve-megabytes"));
}
