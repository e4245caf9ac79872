#include "core/bootstrap/acceptance.h"

#include <catch2/catch.hpp>

#include "core/bootstrap/round_scans.h"

using namespace shaped;

namespace {

BootstrapRound roundOf(const std::vector<double>& chamfers) {
  BootstrapRound round;
  for (const double chamfer : chamfers) {
    auto& scan = round.scans.emplace_back();
    scan.scan = round.scans.size() - 1;
    scan.chamfer = chamfer;
  }
  return round;
}

std::vector<std::size_t> joinedOf(const BootstrapRound& round) {
  std::vector<std::size_t> joined;
  for (const auto& scan : round.scans)
    if (scan.verdict == ScanVerdict::kJoined) joined.push_back(scan.scan);
  return joined;
}

}  // namespace

TEST_CASE("those join that lie within a standard deviation of the nearest") {
  // Mean 5, variance ((-3)^2 + (-1)^2 + 1^2 + 3^2) / 4 = 5.
  auto round = roundOf({0.004, 0.002, 0.006, 0.008});
  judge(1, round);
  CHECK(round.smallest == 0.002);
  CHECK(round.largest == 0.008);
  CHECK(round.accepted_below == Approx(0.002 + std::sqrt(5e-6)));
  CHECK(joinedOf(round) == std::vector<std::size_t>{0, 1});
  CHECK(round.joined == 2);
  CHECK(round.scans[2].verdict == ScanVerdict::kTooFar);
  CHECK(round.scans[2].why == "lies 6.00 mm from its registration, and the round accepts up to 4.24 mm");
  CHECK(round.scans[0].why.empty());

  round = roundOf({0.004, 0.002, 0.006, 0.008});
  judge(2, round);
  CHECK(joinedOf(round) == std::vector<std::size_t>{0, 1, 2});
  round = roundOf({0.004, 0.002, 0.006, 0.008});
  judge(0, round);
  CHECK(joinedOf(round) == std::vector<std::size_t>{1});
  round = roundOf({0.003});
  judge(1, round);
  CHECK(joinedOf(round) == std::vector<std::size_t>{0});
}

TEST_CASE("who failed is not compared, however near") {
  auto round = roundOf({0.0001, 0.002, 0.9, 0.003});
  round.scans[0].verdict = ScanVerdict::kDoubtful;
  round.scans[2].verdict = ScanVerdict::kFailed;
  judge(1, round);
  CHECK(round.smallest == 0.002);
  CHECK(round.accepted_below == Approx(0.0025));
  CHECK(joinedOf(round) == std::vector<std::size_t>{1});
  CHECK(round.scans[0].verdict == ScanVerdict::kDoubtful);
  CHECK(round.scans[2].verdict == ScanVerdict::kFailed);

  auto none = roundOf({0.1});
  none.scans[0].verdict = ScanVerdict::kFailed;
  judge(1, none);
  CHECK(none.joined == 0);
  CHECK(none.accepted_below == 0);
}

TEST_CASE("a round tries what is left, or a draw of it") {
  BootstrapOptions options;
  auto first = roundOf({0, 0, 0, 0, 0, 0});
  first.scans[1].verdict = ScanVerdict::kJoined;
  first.scans[2].verdict = ScanVerdict::kUnusable;
  first.scans[3].verdict = ScanVerdict::kTooFar;
  first.scans[4].verdict = ScanVerdict::kDoubtful;
  first.scans[5].verdict = ScanVerdict::kFailed;
  CHECK(scansToTry(3, {}, options) == std::vector<std::size_t>{0, 1, 2});
  CHECK(scansToTry(7, {first}, options) == std::vector<std::size_t>{0, 3, 4, 5, 6});

  options.sample = 3;
  std::vector<int> drawn(7, 0);
  for (options.seed = 0; options.seed < 200; ++options.seed) {
    const auto chosen = scansToTry(7, {first}, options);
    REQUIRE(chosen.size() == 3);
    CHECK(chosen == scansToTry(7, {first}, options));
    CHECK((chosen[0] < chosen[1] && chosen[1] < chosen[2]));
    for (const auto scan : chosen) ++drawn[scan];
  }
  CHECK(drawn[1] + drawn[2] == 0);
  for (const std::size_t scan : {0, 3, 4, 5, 6}) {
    INFO(scan << " was drawn " << drawn[scan] << " times");
    CHECK(std::abs(drawn[scan] - 120) < 40);
  }
  options.sample = 5;
  CHECK(scansToTry(7, {first}, options) == std::vector<std::size_t>{0, 3, 4, 5, 6});
}

TEST_CASE("options of a bootstrap are checked by name") {
  const auto violation = [](const auto& change) {
    BootstrapOptions options;
    change(options);
    return options.firstViolation().value_or("");
  };
  CHECK(violation([](auto&) {}).empty());
  CHECK(violation([](auto& o) { o.rounds = 0; }) == "rounds = 0, want >= 1");
  CHECK(violation([](auto& o) { o.modes = 0; }) == "modes = 0, want >= 1");
  CHECK(violation([](auto& o) { o.least_joined = 0; }) == "least_joined = 0, want >= 1");
  CHECK(violation([](auto& o) { o.sample = -1; }) == "sample = -1, want >= 0");
  CHECK_THAT(violation([](auto& o) { o.acceptance = -1; }), Catch::StartsWith("acceptance = -1"));
  CHECK_THAT(violation([](auto& o) { o.reach = 0; }), Catch::StartsWith("reach = 0"));
  CHECK_THAT(violation([](auto& o) { o.registration.unit_factor = 0; }), Catch::StartsWith("registration.unit_factor"));
  CHECK_THAT(violation([](auto& o) { o.scanner.points = 0; }), Catch::StartsWith("scanner.points"));
}
