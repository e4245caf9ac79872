#include "core/model/marker_fitter.h"

#include <catch2/catch.hpp>

#include "core/mesh/quality.h"
#include "core/model/marker_fitter_checkpoint.h"
#include "core/numerics/error.h"
#include "core/model/shell_pga_tasks.h"
#include "tests/support/models.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::test;

namespace {

const std::vector<std::int32_t> kVertices{0, 9, 18, 27, 36, 45, 54, 63, 72, 81, 90, 99, 108, 117, 126, 135, 144, 157};

MarkerSet markersAt(const std::vector<std::int32_t>& vertices) {
  MarkerSet set;
  for (const auto vertex : vertices) {
    MarkerSet::Marker marker;
    marker.label = "M" + std::to_string(vertex);
    marker.vertex = vertex;
    set.markers.push_back(marker);
  }
  return set;
}

Vertices modelShape(double angle) { return moveRigidly(project(*tubeModel(), bentTube(angle), {}).solution.shape, 3); }

}  // namespace

TEST_CASE("markers at full-resolution vertices bring a model shape back at full resolution") {
  MarkerFitter fitter(tubeModel(), markersAt(kVertices), {});
  for (const double angle : {0.5, 0.45, 0.4}) {
    const auto truth = modelShape(angle);
    const auto fit = fitter.fit(truth(kVertices, Eigen::all));
    REQUIRE(fit.converged());
    CHECK(fit.solution.shape.rows() == truth.rows());
    CHECK(rmsVertexDistance(fit.solution.shape, truth) < 0.04);  // of a tube 4 m long
    CHECK(fit.solution.fit.rms < 0.02);
    CHECK(fit.solution.smallest_area_ratio > 0.3);
  }
}

TEST_CASE("a marker on a face sits where its barycentric weights say") {
  const auto& model = *tubeModel();
  auto set = markersAt(kVertices);
  auto& marker = set.markers[4];
  marker.vertex = -1;
  marker.face = 100;
  marker.barycentric = {0.2, 0.3, 0.5};
  const auto truth = modelShape(0.5);
  Vertices markers = truth(kVertices, Eigen::all);
  markers.row(4).setZero();
  for (int c = 0; c < 3; ++c) markers.row(4) += marker.barycentric[c] * truth.row(model.topology().faces()(100, c));
  MarkerFitter fitter(tubeModel(), set, {});
  const auto fit = fitter.fit(markers);
  REQUIRE(fit.converged());
  CHECK(fit.solution.fit.residuals[4] < 0.05);
  markers.row(4) = truth.row(kVertices[4]);  // the control: the vertex the marker was at before is elsewhere
  MarkerFitter other(tubeModel(), set, {});
  CHECK(other.fit(markers).solution.fit.residuals[4] > 0.05);
}

TEST_CASE("markers that do not fit the model are refused by name") {
  auto set = markersAt(kVertices);
  set.markers[2].vertex = 9999;
  CHECK_THROWS_WITH(MarkerFitter(tubeModel(), set, {}), Catch::Contains("markers[2]") && Catch::Contains("M18"));
  set = markersAt(kVertices);
  set.markers[3].vertex = -1;
  set.markers[3].face = 9999;
  CHECK_THROWS_WITH(MarkerFitter(tubeModel(), set, {}), Catch::Contains("markers[3]") && Catch::Contains("face 9999"));
  CHECK_THROWS_WITH(MarkerFitter(tubeModel(), markersAt({1, 2}), {}), Catch::Contains("at least three"));
}

TEST_CASE("a take that goes on from a checkpoint after any frame is fitted as if it had not been interrupted") {
  std::vector<MarkerPositions> frames;
  for (const double angle : {0.5, 0.45, 0.4, 0.3}) frames.push_back(modelShape(angle)(kVertices, Eigen::all));
  frames[2].topRows(16).setConstant(std::nan(""));  // held
  const auto begin = [&] {
    MarkerFitter fitter(tubeModel(), markersAt(kVertices), {});
    fitter.calibrate({frames[1]});
    return fitter;
  };
  std::vector<FittedFrame> whole;
  auto one = begin();
  for (const auto& frame : frames) whole.push_back(one.fit(frame).solution);
  REQUIRE(whole[2].fit.held);

  const TemporaryFolder folder;
  for (std::size_t done = 0; done < frames.size(); ++done) {
    INFO(done << " frames before the interruption");
    auto before = begin();
    for (std::size_t i = 0; i < done; ++i) before.fit(frames[i]);
    writeFitterCheckpoint(folder / "c", {static_cast<std::int64_t>(done), before.state()});
    const auto read = readFitterCheckpoint(folder / "c");
    CHECK(read.frames == static_cast<std::int64_t>(done));
    MarkerFitter after(tubeModel(), markersAt(kVertices), {});
    after.resume(read.state);
    for (std::size_t i = done; i < frames.size(); ++i) {
      const auto fit = after.fit(frames[i]).solution;
      CHECK(fit.shape == whole[i].shape);
      CHECK(fit.fit.scale == whole[i].fit.scale);
      CHECK(fit.fit.point.alpha == whole[i].fit.point.alpha);
    }
  }
  MarkerTrackerState foreign;
  CHECK_THROWS_WITH(one.resume(foreign), Catch::Contains("state"));
  auto bytes = bytesOf(folder / "c");
  bytes[bytes.size() / 2] ^= 1;
  CHECK_THROWS_AS(readFitterCheckpoint(folder.file("damaged", bytes)), InvalidInput);
}
