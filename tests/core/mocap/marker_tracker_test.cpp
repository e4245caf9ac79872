#include "core/mocap/marker_tracker.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/mesh/alignment.h"
#include "core/numerics/error.h"
#include "tests/support/submanifolds.h"

using namespace shaped;
using namespace shaped::test;

namespace {

/// Fourteen vertices all over the tube.
const std::vector<std::int32_t> kMarkers{0, 2, 5, 9, 12, 15, 19, 22, 26, 29, 31, 35, 38, 41};

struct Trial {
  std::shared_ptr<const Submanifold> submanifold = tubeSubmanifold(2);
  const Topology& topology = submanifold->calculus().topology();
  std::vector<MarkerSite> sites;

  Trial() {
    for (const auto vertex : kMarkers) sites.push_back({anchorAt(topology, vertex), Eigen::Vector3d::Zero(), {}, {}});
  }

  /// A shape of the submanifold somewhere in space; a slow motion over `time`.
  Vertices truth(double time) const {
    const Vertices shape = shapeAt(*submanifold, Eigen::Vector2d(0.5 - 0.04 * time, -0.15 + 0.02 * time));
    return apply(alignRigidly(submanifold->pga().mean, moveRigidly(submanifold->pga().mean, 6)), shape);
  }

  MarkerPositions markers(const Vertices& shape) const { return shape(kMarkers, Eigen::all); }

  MarkerTracker tracker(const MarkerTrackerOptions& options = {}) const { return {submanifold, sites, options}; }
};

double largestGap(const Vertices& a, const Vertices& b) { return (a - b).rowwise().norm().maxCoeff(); }

double largestResidualBut(const MarkerFit& fit, Eigen::Index left_out) {
  double largest = 0;
  for (Eigen::Index l = 0; l < fit.residuals.size(); ++l)
    if (l != left_out) largest = std::max(largest, fit.residuals[l]);
  return largest;
}

}  // namespace

TEST_CASE("exact markers of shapes on the submanifold bring the shapes back, frame after frame") {
  const Trial trial;
  auto tracker = trial.tracker();
  for (int frame = 0; frame < 4; ++frame) {
    const auto truth = trial.truth(frame);
    const auto fit = tracker.fit(trial.markers(truth));
    INFO("frame " << frame);
    REQUIRE(fit.converged());
    CHECK(largestGap(fit.solution.shape, truth) < 0.03);  // of a tube 4 m long
    CHECK(largestGap(fit.solution.projection, truth) < 0.06);
    CHECK(fit.solution.rms < 0.005);
    CHECK(fit.solution.scale == Approx(1).epsilon(0.01));
    CHECK(!fit.solution.held);
  }
  CHECK(largestGap(trial.truth(0), trial.truth(3)) > 0.1);  // the control: it moved
}

TEST_CASE("the size of a subject is found, and one that is given is kept") {
  const Trial trial;
  const Vertices truth = 1.7 * trial.truth(0);
  auto tracker = trial.tracker();
  const auto fit = tracker.fit(trial.markers(truth));
  REQUIRE(fit.converged());
  CHECK(fit.solution.scale == Approx(1.7).epsilon(0.01));
  CHECK(largestGap(fit.solution.shape, truth) < 0.06);

  MarkerTrackerOptions given;
  given.scale = 1.5;
  auto fixed = trial.tracker(given);
  CHECK(fixed.fit(trial.markers(truth)).solution.scale == 1.5);
}

TEST_CASE("the size comes from the frames that the model explains best") {
  const Trial trial;
  Vertices crumpled = trial.truth(0);
  for (Eigen::Index v = 0; v < crumpled.rows(); ++v)
    crumpled.row(v) *= 1 + 0.2 * std::sin(7.0 * static_cast<double>(v));
  auto tracker = trial.tracker();
  const auto calibrated = tracker.calibrate(
      {trial.markers(1.3 * trial.truth(0)), trial.markers(crumpled), trial.markers(1.3 * trial.truth(3))});
  CHECK(calibrated.converged());
  const auto fit = tracker.fit(trial.markers(1.3 * trial.truth(1)));
  REQUIRE(fit.converged());
  CHECK(fit.solution.scale == Approx(1.3).epsilon(0.01));
  CHECK(tracker.fit(trial.markers(1.3 * trial.truth(2))).solution.scale == fit.solution.scale);

  auto uncalibrated = trial.tracker();
  CHECK(uncalibrated.calibrate({}).converged());
  CHECK(uncalibrated.fit(trial.markers(1.3 * trial.truth(1))).solution.scale == Approx(1.3).epsilon(0.01));
}

TEST_CASE("markers that are not seen neither pull nor count") {
  const Trial trial;
  auto tracker = trial.tracker();
  const auto truth = trial.truth(0);
  MarkerPositions markers = trial.markers(truth);
  for (const Eigen::Index missing : {3, 8}) markers.row(missing).setConstant(std::nan(""));
  const auto fit = tracker.fit(markers);
  REQUIRE(fit.converged());
  CHECK(std::isnan(fit.solution.residuals[3]));
  CHECK(fit.solution.weights[8] == 0);
  CHECK(fit.solution.rms < 0.005);
  CHECK(largestGap(fit.solution.shape, truth) < 0.05);
}

TEST_CASE("one gross outlier, in the first frame or later, is told apart") {
  const Trial trial;
  for (const int bad_frame : {0, 1}) {
    auto tracker = trial.tracker();
    Solved<MarkerFit> fit;
    for (int frame = 0; frame <= bad_frame; ++frame) {
      MarkerPositions markers = trial.markers(trial.truth(frame));
      if (frame == bad_frame) markers.row(5) += Eigen::RowVector3d(2, -3, 2.5);
      fit = tracker.fit(markers);
      REQUIRE(fit.converged());
    }
    INFO("frame " << bad_frame);
    CHECK(fit.solution.weights[5] < 1e-3);
    CHECK(fit.solution.residuals[5] > 3);
    CHECK(largestResidualBut(fit.solution, 5) < 0.02);
    CHECK(largestGap(fit.solution.shape, trial.truth(bad_frame)) < 0.06);
    CHECK(fit.solution.scale == Approx(1).epsilon(0.01));
  }
  MarkerTrackerOptions least_squares;  // the control
  least_squares.robust_scale = 0;
  auto tracker = trial.tracker(least_squares);
  MarkerPositions markers = trial.markers(trial.truth(0));
  markers.row(5) += Eigen::RowVector3d(2, -3, 2.5);
  CHECK(largestResidualBut(tracker.fit(markers).solution, 5) > 0.1);
}

TEST_CASE("offsets from the skin turn with the surface") {
  Trial trial;
  const Vertices& mean = trial.submanifold->pga().mean;
  std::vector<std::int32_t> everything(static_cast<std::size_t>(mean.rows()));
  for (std::size_t v = 0; v < everything.size(); ++v) everything[v] = static_cast<std::int32_t>(v);
  for (std::size_t l = 0; l < trial.sites.size();
       ++l) {  // one rigid patch: the offsets follow the whole body's rotation
    trial.sites[l].offset = Eigen::Vector3d(0.1, 0.05 * static_cast<double>(l % 3), -0.08);
    trial.sites[l].patch = everything;
    trial.sites[l].patch_template = mean;
  }
  const auto truth = trial.truth(0);
  const auto motion = alignRigidly(mean, truth);
  MarkerPositions markers = trial.markers(truth);
  for (std::size_t l = 0; l < trial.sites.size(); ++l)
    markers.row(static_cast<Eigen::Index>(l)) += (motion.rotation * trial.sites[l].offset).transpose();
  auto tracker = trial.tracker();
  const auto fit = tracker.fit(markers);
  REQUIRE(fit.converged());
  CHECK(fit.solution.rms < 0.005);
  CHECK(largestGap(fit.solution.shape, truth) < 0.05);
}

TEST_CASE("a frame with too few markers repeats the last shape and says so") {
  const Trial trial;
  auto tracker = trial.tracker();
  const auto before = tracker.fit(trial.markers(trial.truth(0)));
  MarkerPositions markers = trial.markers(trial.truth(1));
  markers.bottomRows(markers.rows() - 2).setConstant(std::nan(""));
  const auto held = tracker.fit(markers);
  CHECK(held.solution.held);
  CHECK(largestGap(held.solution.shape, before.solution.shape) == 0);
  const auto after = tracker.fit(trial.markers(trial.truth(2)));
  CHECK(!after.solution.held);
  CHECK(largestGap(after.solution.shape, trial.truth(2)) < 0.03);
}

TEST_CASE("bad frames, sites and options of a tracker are refused by name") {
  const Trial trial;
  auto tracker = trial.tracker();
  CHECK_THROWS_WITH(tracker.fit(Vertices::Zero(3, 3)), Catch::Contains("markers") && Catch::Contains("3 rows"));
  CHECK_THROWS_WITH(tracker.fit(Vertices::Zero(static_cast<Eigen::Index>(kMarkers.size()), 3)),
                    Catch::Contains("fewer than three markers, or only markers on one line"));
  const auto good = trial.markers(trial.truth(0));
  CHECK_THROWS_WITH(tracker.calibrate({good, Vertices::Zero(2, 3)}), Catch::Contains("calibration[1]"));
  CHECK_THROWS_WITH(tracker.calibrate({Vertices::Zero(good.rows(), 3)}), Catch::Contains("calibration[0]"));
  auto two = trial.sites;
  two.resize(2);
  CHECK_THROWS_WITH(MarkerTracker(trial.submanifold, two, {}), Catch::Contains("marker_set"));
  const auto refused = [&](const MarkerTrackerOptions& options, const std::string& reason) {
    CHECK_THROWS_WITH(MarkerTracker(trial.submanifold, trial.sites, options), Catch::Contains(reason));
  };
  MarkerTrackerOptions options;
  options.prior_weight = 0;
  refused(options, "prior_weight");
  options = {};
  options.robust_scale = -1;
  refused(options, "robust_scale");
  options = {};
  options.scale = 0.0;
  refused(options, "scale");
  options = {};
  options.alternations = 0;
  refused(options, "alternations");
}

TEST_CASE("a tracker stops when told to") {
  const Trial trial;
  std::stop_source stop;
  MarkerTrackerOptions options;
  options.submanifold.stop = stop.get_token();
  auto tracker = trial.tracker(options);
  stop.request_stop();
  CHECK(tracker.fit(trial.markers(trial.truth(0))).termination == Termination::kCancelled);
  CHECK(tracker.calibrate({trial.markers(trial.truth(0))}).termination == Termination::kCancelled);
}
