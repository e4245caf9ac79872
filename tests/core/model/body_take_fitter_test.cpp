#include "core/model/body_take_fitter.h"

#include <catch2/catch.hpp>
#include <random>

#include "core/mesh/quality.h"
#include "core/model/body_shapes.h"
#include "core/numerics/error.h"
#include "tests/support/bodies.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::test;

namespace {

const std::shared_ptr<const BodyModel>& model() {
  static const auto body = std::make_shared<const BodyModel>(test::tubeModel(3, 10, 3));
  return body;
}

/// Markers at every third vertex, each a centimetre off the skin where `offset` is.
MarkerSet markerSet(bool offset) {
  MarkerSet set;
  const auto normals = vertexNormals(model()->topology()->faces(), model()->parts().mean);
  for (std::int32_t v = 0; v < normals.rows(); v += 3) {
    set.markers.push_back({"m" + std::to_string(v), v, -1, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()});
    if (offset) set.markers.back().offset = 0.01 * normals.row(v);
  }
  return set;
}

/// What is seen of one person in motion: all joints turn a little further from frame to frame.
struct Take {
  std::vector<MarkerPositions> frames;
  std::vector<Vertices> shapes;
  Eigen::VectorXd identity;
};

Take take(int frames, double noise, unsigned seed = 13) {
  Take result;
  result.identity = 0.8 * randomIdentity(*model(), 11);
  const auto far = randomPose(model()->skeleton(), 0.5, 12);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (int k = 0; k < frames; ++k) {
    BodyState state{result.identity, far};
    state.pose.rotations *= static_cast<double>(k) / frames;
    result.shapes.push_back(model()->posed(state).vertices());
    const auto& shape = result.shapes.back();
    MarkerPositions markers((shape.rows() + 2) / 3, 3);
    for (Eigen::Index l = 0; l < markers.rows(); ++l) {
      markers.row(l) = shape.row(3 * l);
      for (auto& x : markers.row(l)) x += noise * normal(random);
    }
    result.frames.push_back(std::move(markers));
  }
  return result;
}

}  // namespace

TEST_CASE("a body follows a take of markers, from the first frame's identity on") {
  const auto seen = take(6, 0);
  BodyTakeFitter fitter(model(), markerSet(false), {});
  Eigen::VectorXd first;
  for (std::size_t k = 0; k < seen.frames.size(); ++k) {
    const auto solved = fitter.fit(seen.frames[k]);
    CHECK(solved.converged());
    CHECK(solved.solution.rms < 2e-3);
    CHECK(rmsVertexDistance(solved.solution.shape, seen.shapes[k]) < 5e-3);
    CHECK_FALSE(solved.solution.held);
    const Eigen::VectorXd identity = std::get<BodyCoefficients>(solved.solution.point).numbers.head(3);
    if (k == 0) first = identity;
    CHECK(identity == first);  // the same person
    CHECK((identity - seen.identity).norm() < 0.2);
  }
}

TEST_CASE("a calibration settles who it is before the first frame") {
  double alone = 0, calibrated = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    const auto seen = take(6, 0.01, seed);
    const auto error = [&](bool calibrate) {
      BodyTakeFitter fitter(model(), markerSet(false), {});
      if (calibrate) fitter.calibrate(seen.frames);
      const auto solved = fitter.fit(seen.frames[0]);
      return (std::get<BodyCoefficients>(solved.solution.point).numbers.head(3) - seen.identity).norm();
    };
    alone += error(false);
    calibrated += error(true);
  }
  CHECK(calibrated < 0.8 * alone);
}

TEST_CASE("markers that are missing or far off do not lead a body astray") {
  auto seen = take(3, 0);
  for (auto& frame : seen.frames) {
    for (const Eigen::Index l : {1, 5, 9}) frame.row(l).setConstant(std::numeric_limits<double>::quiet_NaN());
    frame.row(14) += Eigen::RowVector3d(0, 1.5, 0);  // a marker taken for another
  }
  const auto worst = [&](double robust_scale) {
    TakeOptions options;
    options.robust_scale = robust_scale;
    BodyTakeFitter fitter(model(), markerSet(false), options);
    double distance = 0;
    for (std::size_t k = 0; k < seen.frames.size(); ++k) {
      const auto frame = fitter.fit(seen.frames[k]).solution;
      CHECK(std::isnan(frame.residuals[5]));
      CHECK(std::isfinite(frame.residuals[6]));
      distance = std::max(distance, rmsVertexDistance(frame.shape, seen.shapes[k]));
    }
    return distance;
  };
  CHECK(worst(0.05) < 0.01);
  CHECK(worst(0) > 2 * worst(0.05));
}

TEST_CASE("a marker's offset turns with the body") {
  const auto set = markerSet(true);
  auto seen = take(4, 0);
  for (std::size_t k = 0; k < seen.frames.size(); ++k) {
    const auto normals = vertexNormals(model()->topology()->faces(), seen.shapes[k]);
    for (Eigen::Index l = 0; l < seen.frames[k].rows(); ++l) seen.frames[k].row(l) += 0.01 * normals.row(3 * l);
  }
  const auto worst = [&](const MarkerSet& markers) {
    BodyTakeFitter fitter(model(), markers, {});
    double distance = 0;
    for (std::size_t k = 0; k < seen.frames.size(); ++k)
      distance = std::max(distance, rmsVertexDistance(fitter.fit(seen.frames[k]).solution.shape, seen.shapes[k]));
    return distance;
  };
  const double with = worst(set), without = worst(markerSet(false));
  CHECK(with < 4e-3);
  CHECK(without > 1.5 * with);
}

TEST_CASE("a take that shows too little is refused at first, and then held") {
  const auto seen = take(2, 0);
  MarkerPositions blind = seen.frames[1];
  blind.bottomRows(blind.rows() - 2).setConstant(std::numeric_limits<double>::quiet_NaN());
  BodyTakeFitter fitter(model(), markerSet(false), {});
  CHECK_THROWS_WITH(fitter.fit(blind),
                    "markers: the first frame shows fewer than three markers, or only markers on one line");
  CHECK_THROWS_WITH(fitter.calibrate({seen.frames[0], blind}),
                    "calibration[1]: shows fewer than three markers, or only markers on one line");
  CHECK_THROWS_WITH(fitter.fit(seen.frames[0].topRows(4)),
                    Catch::Contains("markers: has 4 rows, want one for each of"));
  const auto first = fitter.fit(seen.frames[0]).solution;
  const auto held = fitter.fit(blind).solution;
  CHECK(held.held);
  CHECK(held.shape == first.shape);
}

TEST_CASE("a take goes on from its file as if it had not been interrupted") {
  const auto seen = take(4, 0.002);
  const TemporaryFolder folder;
  BodyTakeFitter one(model(), markerSet(false), {}), other(model(), markerSet(false), {});
  one.calibrate({seen.frames[0], seen.frames[3]});
  one.fit(seen.frames[0]);
  one.fit(seen.frames[1]);
  const auto keep = one.state();
  const auto next = one.fit(seen.frames[2]).solution.shape;
  keep(folder.path() / "state", 2);  // as it was when it was asked for
  CHECK(other.resume(folder.path() / "state") == 2);
  CHECK(other.fit(seen.frames[2]).solution.shape == next);
}

TEST_CASE("what does not fit a body's take is refused by name") {
  const auto refused = [](const MarkerSet& set, const TakeOptions& options, const std::string& text) {
    CHECK_THROWS_WITH(BodyTakeFitter(model(), set, options), Catch::Contains(text));
  };
  const auto set = markerSet(false);
  refused({{set.markers[0], set.markers[1]}}, {}, "marker_set: has 2 markers, a fit needs at least three");
  auto far = set;
  far.markers[2].vertex = 100'000;
  refused(far, {}, "markers[2] (m6): vertex 100000 is outside [0, ");
  far.markers[2] = {"x", -1, 100'000, Eigen::Vector3d::UnitX(), Eigen::Vector3d::Zero()};
  refused(far, {}, "markers[2] (x): face 100000 is outside [0, ");
  TakeOptions options;
  options.modes = 4;
  refused(set, options, "modes: 4, want at most the model's 3");
  options = {};
  options.scale = 1.1;
  refused(set, options, "scale: = 1.100000, and a model of kind body has its size in its identity: leave it out");
  options = {};
  options.prior_weight = 0;
  refused(set, options, "prior_weight: = 0");
  options = {};
  options.robust_scale = -1;
  refused(set, options, "robust_scale: = -1");
}
