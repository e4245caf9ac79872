#include "core/model/marker_fitter.h"

#include <catch2/catch.hpp>

#include "core/mesh/quality.h"
#include "core/model/shell_pga_tasks.h"
#include "tests/support/models.h"
#include "tests/support/shapes.h"

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
