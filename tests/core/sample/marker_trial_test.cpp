#include "core/sample/marker_trial.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "core/mesh/quality.h"
#include "tests/core/sample/sample_fixture.h"

using namespace shaped;

TEST_CASE("the markers have labels and vertices of their own, left and right mirrored") {
  const auto& creature = defaultCreature();
  const auto set = creatureMarkers(creature);
  std::set<std::string> labels;
  std::set<std::int32_t> vertices;
  for (const auto& marker : set.markers) {
    labels.insert(marker.label);
    vertices.insert(marker.vertex);
    CHECK(marker.vertex >= 0);
    CHECK(marker.vertex < creature.topology->vertexCount());
    const double x = creature.rest(marker.vertex, 0);
    const bool paired = marker.label[0] == 'L' || (marker.label[0] == 'R' && marker.label != "RUMP");
    if (paired) CHECK((marker.label[0] == 'L' ? x : -x) > 0.01);
  }
  CHECK(set.markers.size() == 32);
  CHECK(labels.size() == 32);
  CHECK(vertices.size() == 32);
}

TEST_CASE("a trial sees the moving skin with the asked noise and gaps") {
  SampleTrialOptions options;
  options.frames = 200;
  const auto sample = sampleMarkerTrial(defaultCreature(), options);
  REQUIRE(sample.trial.frames.size() == 200);
  REQUIRE(sample.truth.size() == 200);
  CHECK(sample.trial.rate_hz == 30);
  double squares = 0;
  int seen = 0, missing = 0;
  for (std::size_t frame = 0; frame < 200; ++frame)
    for (std::size_t m = 0; m < 32; ++m) {
      const Eigen::RowVector3d at = sample.trial.frames[frame].row(Eigen::Index(m));
      if (std::isnan(at.x())) {
        CHECK((std::isnan(at.y()) && std::isnan(at.z())));
        ++missing;
        continue;
      }
      squares += (at - sample.truth[frame].row(sample.markers.markers[m].vertex)).squaredNorm();
      ++seen;
    }
  CHECK(std::sqrt(squares / (3 * seen)) == Approx(0.0025).epsilon(0.05));
  CHECK(missing / (200.0 * 32) == Approx(0.05).margin(0.015));
}

TEST_CASE("without noise and dropout the trial is the truth") {
  SampleTrialOptions options;
  options.frames = 5;
  options.noise = 0;
  options.dropout = 0;
  const auto sample = sampleMarkerTrial(defaultCreature(), options);
  for (std::size_t frame = 0; frame < 5; ++frame)
    for (std::size_t m = 0; m < 32; ++m)
      CHECK(sample.trial.frames[frame].row(Eigen::Index(m)) ==
            sample.truth[frame].row(sample.markers.markers[m].vertex));
}

TEST_CASE("a trial depends on its seed alone, and its skin stays sound") {
  const auto one = sampleMarkerTrial(defaultCreature()), two = sampleMarkerTrial(defaultCreature());
  CHECK(one.truth.back() == two.truth.back());
  SampleTrialOptions options;
  options.seed = 2;
  CHECK(meanVertexDistance(sampleMarkerTrial(defaultCreature(), options).truth.front(), one.truth.front()) > 0.005);
  for (const auto& shape : one.truth)
    CHECK(smallestAreaRatio(defaultCreature().topology->faces(), defaultCreature().rest, shape) > 0.05);
}

TEST_CASE("trial options out of range are refused by name") {
  SampleTrialOptions options;
  options.frames = 0;
  CHECK_THROWS_WITH(sampleMarkerTrial(defaultCreature(), options), Catch::Contains("frames = 0, want >= 1"));
  options = {};
  options.dropout = 0.9;
  CHECK_THROWS_WITH(sampleMarkerTrial(defaultCreature(), options), Catch::Contains("dropout"));
}
