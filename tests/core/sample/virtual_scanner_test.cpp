#include "core/sample/virtual_scanner.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "core/io/mesh_file.h"
#include "core/io/scan_file.h"
#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/surface/closest_point.h"
#include "tests/support/real_data.h"
#include "tests/support/shapes.h"

using namespace shaped;
using Catch::Contains;
using Point = Eigen::RowVector3d;

namespace {

/// No noise, no outliers, no motion: what the cameras see and nothing else.
VirtualScannerOptions exactOptions(int points) {
  VirtualScannerOptions options;
  options.points = points;
  options.noise = options.normal_noise = options.outliers = 0;
  options.motion = RigidMotion{};
  return options;
}

struct Surface {
  Vertices vertices;
  Faces faces;
};

Surface sphere(int levels, double radius = 1, const Point& centre = Point::Zero()) {
  const auto mesh = test::icosphere(levels);
  return {(radius * mesh.vertices).rowwise() + centre, mesh.topology->faces()};
}

Surface together(const Surface& one, const Surface& two) {
  Surface both{Vertices(one.vertices.rows() + two.vertices.rows(), 3), Faces(one.faces.rows() + two.faces.rows(), 3)};
  both.vertices << one.vertices, two.vertices;
  both.faces << one.faces, (two.faces.array() + static_cast<std::int32_t>(one.vertices.rows())).matrix();
  return both;
}

double angle(const Point& one, const Point& two) { return std::atan2(one.cross(two).norm(), one.dot(two)); }

double distanceToSegment(const Point& point, const Point& from, const Point& to) {
  const double along = std::clamp((point - from).dot(to - from) / (to - from).squaredNorm(), 0.0, 1.0);
  return (from + along * (to - from) - point).norm();
}

/// Distances of the points that are no outliers to the mesh, ascending; the scan moved back into the mesh's frame.
std::vector<double> sortedDistances(const Scan& scan, const RigidMotion& motion, std::vector<Eigen::Index> outliers,
                                    const MeshFile& mesh) {
  const Eigen::VectorXd all = distancesToSurface(apply(inverse(motion), scan.points), mesh.vertices, mesh.faces);
  std::vector<double> kept;
  for (Eigen::Index i = 0; i < all.size(); ++i)
    if (!std::binary_search(outliers.begin(), outliers.end(), i)) kept.push_back(all[i]);
  std::sort(kept.begin(), kept.end());
  return kept;
}

double quantile(const std::vector<double>& sorted, double share) {
  return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
}

}  // namespace

TEST_CASE("surface samples fall on faces by their area, and evenly within each") {
  // Areas over four orders of magnitude, and one face without.
  Vertices vertices(6, 3);
  vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0.1, 0, 0, 0, 0.1, 0, 0.01, 0.01, 0.02;
  Faces faces(6, 3);
  faces << 0, 1, 2, 0, 3, 4, 1, 1, 2, 0, 3, 5, 3, 4, 5, 1, 2, 5;
  const Eigen::VectorXd areas = triangleAreas(faces, vertices);
  const SurfaceSampler sampler(vertices, faces);
  Random random(3);
  const int draws = 400000;
  Eigen::VectorXd counts = Eigen::VectorXd::Zero(faces.rows());
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (int i = 0; i < draws; ++i) {
    const auto sample = sampler(random);
    counts[sample.face] += 1;
    moments += sample.barycentric.transpose() * sample.barycentric / draws;
    if (sample.barycentric.minCoeff() < 0 || std::abs(sample.barycentric.sum() - 1) > 1e-15) FAIL("no weights");
  }
  CHECK(counts[2] == 0);
  const Eigen::VectorXd expected = draws * areas / areas.sum();
  double chi_square = 0;
  for (const int f : {0, 1, 3, 4, 5}) chi_square += std::pow(counts[f] - expected[f], 2) / expected[f];
  CHECK(chi_square < 20);  // four degrees of freedom: exceeded once in 2000 tries
  // Evenly over a triangle: E b_i b_j = (1 + [i = j]) / 12.
  CHECK((moments - (Eigen::Matrix3d::Ones() + Eigen::Matrix3d::Identity()) / 12).cwiseAbs().maxCoeff() < 0.001);
}

TEST_CASE("a virtual scan of a sphere sees what faces a camera, evenly by area") {
  const auto mesh = sphere(4);
  const auto options = exactOptions(20000);
  const auto result = scanVirtually(mesh.vertices, mesh.faces, options);
  const auto cameras = cameraPositions(mesh.vertices, options);
  const Vertices normals = faceNormals(mesh.faces, mesh.vertices);
  const auto cosine = [&](const Point& at, std::int32_t face, Eigen::Index camera) {
    return (cameras.row(camera) - at).normalized().dot(normals.row(face));
  };
  REQUIRE(result.scan.points.rows() == 20000);
  REQUIRE(result.truth.size() == 20000);
  CHECK(result.scan.faces.rows() == 0);
  CHECK(result.outliers.empty());
  double smallest = 1, farthest = 0;
  Eigen::VectorXd used = Eigen::VectorXd::Zero(8);
  for (Eigen::Index i = 0; i < 20000; ++i) {
    const auto& [place, camera] = result.truth[static_cast<std::size_t>(i)];
    smallest = std::min(smallest, cosine(result.scan.points.row(i), place.face, camera));
    farthest = std::max(farthest, (result.scan.points.row(i) - at(place, mesh.faces, mesh.vertices)).norm());
    used[camera] += 1;
  }
  CHECK(smallest > 0.33);
  CHECK(smallest < 0.34);
  CHECK(farthest < 1e-15);
  CHECK(used.minCoeff() > 1500);

  // A sphere hides nothing but its back: the visible share is that of the places turned to some camera.
  std::mt19937_64 random(5);
  std::discrete_distribution<int> face([&] {
    const Eigen::VectorXd areas = triangleAreas(mesh.faces, mesh.vertices);
    return std::discrete_distribution<int>(areas.begin(), areas.end());
  }());
  int seen = 0;
  const int tries = 100000;
  for (int i = 0; i < tries; ++i) {
    const auto f = face(random);
    const Point middle = (mesh.vertices.row(mesh.faces(f, 0)) + mesh.vertices.row(mesh.faces(f, 1)) +
                          mesh.vertices.row(mesh.faces(f, 2))) /
                         3;
    bool any = false;
    for (Eigen::Index camera = 0; camera < 8; ++camera) any = any || cosine(middle, f, camera) > 0.33;
    seen += any;
  }
  CHECK(result.visible_fraction == Approx(double(seen) / tries).margin(0.012));
  // By area: bands of equal height have equal areas (Archimedes), and those around the middle are all seen.
  std::array<int, 8> bands{};
  int in_bands = 0;
  for (const auto& point : result.scan.points.rowwise())
    if (std::abs(point.y()) < 0.4) ++bands[static_cast<std::size_t>((point.y() + 0.4) / 0.1)], ++in_bands;
  double chi_square = 0;
  for (const int count : bands) chi_square += std::pow(count - in_bands / 8.0, 2) / (in_bands / 8.0);
  CHECK(chi_square < 26);  // seven degrees of freedom: exceeded once in 2000 tries
}

TEST_CASE("the noise of a virtual scan lies along the viewing rays and has the asked deviation") {
  const auto mesh = sphere(4);
  auto options = exactOptions(20000);
  options.noise = 0.0015;
  options.normal_noise = 5;
  const auto result = scanVirtually(mesh.vertices, mesh.faces, options);
  const auto cameras = cameraPositions(mesh.vertices, options);
  double sum = 0, squares = 0, across = 0, tilts = 0;
  for (Eigen::Index i = 0; i < 20000; ++i) {
    const auto& [place, camera] = result.truth[static_cast<std::size_t>(i)];
    const Point exact = at(place, mesh.faces, mesh.vertices), ray = (exact - cameras.row(camera)).normalized();
    const Point error = result.scan.points.row(i) - exact;
    sum += error.dot(ray);
    squares += std::pow(error.dot(ray), 2);
    across = std::max(across, error.cross(ray).norm());
    tilts += std::pow(angle(result.scan.normals.row(i), exact.normalized()), 2);
    if (std::abs(result.scan.normals.row(i).norm() - 1) > 1e-14) FAIL("no unit normal");
  }
  // Standard errors with n = 20000: deviation / sqrt(n) of a mean, deviation / sqrt(2 n) of a deviation.
  CHECK(std::abs(sum / 20000) < 4 * 0.0015 / std::sqrt(20000));
  CHECK(std::sqrt(squares / 20000) == Approx(0.0015).epsilon(4 / std::sqrt(40000)));
  CHECK(across < 1e-14);
  // Two tangent directions; the faceted sphere's interpolated normals stray from the round one's by less than 0.1.
  CHECK(std::sqrt(tilts / 20000) * 180 / std::numbers::pi == Approx(5 * std::sqrt(2)).epsilon(0.02));
}

TEST_CASE("what stands before a surface hides it from the virtual scanner") {
  const Point near_centre(0, 0, 0.6), far_centre(0, 0, -0.8);
  const auto front = sphere(3, 0.5, near_centre);
  const auto mesh = together(front, sphere(3, 0.3, far_centre));
  auto options = exactOptions(4000);
  options.below = 0;
  options.cameras = 1;
  const auto one = scanVirtually(mesh.vertices, mesh.faces, options);
  for (const auto& point : one.truth) CHECK(point.place.face < front.faces.rows());

  options.cameras = 8;
  const auto eight = scanVirtually(mesh.vertices, mesh.faces, options);
  const auto cameras = cameraPositions(mesh.vertices, options);
  int far_points = 0;
  for (std::size_t i = 0; i < eight.truth.size(); ++i) {
    const auto& [place, camera] = eight.truth[i];
    if (place.face < front.faces.rows()) continue;
    ++far_points;
    CHECK(camera != 0);
    // The faceted sphere reaches 0.5 only at its vertices, nowhere less than 0.49.
    CHECK(distanceToSegment(near_centre, cameras.row(camera), eight.scan.points.row(Eigen::Index(i))) > 0.49);
  }
  CHECK(far_points > 300);
  CHECK(eight.visible_fraction > one.visible_fraction);
}

TEST_CASE("a scanner for a small thing sees it as the default one sees a person") {
  const auto scanOf = [](double size) {
    const auto [vertices, faces] = sphere(3, size);
    auto options = scannerFor(2 * size);
    options.motion = RigidMotion{};
    return scanVirtually(vertices, faces, options).scan;
  };
  const Scan large = scanOf(1), small = scanOf(0.125);  // an eighth: the same numbers but for their exponents
  REQUIRE(small.points.rows() == large.points.rows());
  CHECK((8 * small.points - large.points).cwiseAbs().maxCoeff() < 1e-6);
  CHECK(scannerFor(2).noise == VirtualScannerOptions().noise);
  CHECK(scannerFor(2).ring_radius == VirtualScannerOptions().ring_radius);
}

TEST_CASE("a virtual scan depends on its input and seed alone") {
  const auto mesh = sphere(3);
  VirtualScannerOptions options;
  options.points = 3000;
  options.holes = 0.1;
  options.cut = 0.1;
  const auto one = scanVirtually(mesh.vertices, mesh.faces, options);
  const auto two = scanVirtually(mesh.vertices, mesh.faces, options);
  CHECK(one.scan.points == two.scan.points);
  CHECK(one.scan.normals == two.scan.normals);
  CHECK(one.outliers == two.outliers);
  CHECK(one.motion.rotation == two.motion.rotation);
  options.seed = 2;
  const auto other = scanVirtually(mesh.vertices, mesh.faces, options);
  CHECK((other.motion.rotation - one.motion.rotation).norm() > 1e-3);
  CHECK(other.outliers != one.outliers);
}

TEST_CASE("knobs of the virtual scanner do not disturb one another") {
  const auto mesh = sphere(3);
  auto options = exactOptions(2000);
  const auto plain = scanVirtually(mesh.vertices, mesh.faces, options);
  options.noise = 0.01;
  options.motion.reset();
  const auto moved = scanVirtually(mesh.vertices, mesh.faces, options);
  for (std::size_t i = 0; i < 2000; ++i) {
    REQUIRE(moved.truth[i].place.face == plain.truth[i].place.face);
    REQUIRE(moved.truth[i].camera == plain.truth[i].camera);
  }
}

TEST_CASE("outliers of a virtual scan have their share and fill the box around the mesh") {
  const auto mesh = sphere(3);
  auto options = exactOptions(20000);
  options.outliers = 0.1;
  options.outlier_box = 0.5;
  const auto result = scanVirtually(mesh.vertices, mesh.faces, options);
  REQUIRE(result.scan.points.rows() == 20000);
  REQUIRE(result.outliers.size() == 2000);
  CHECK(std::is_sorted(result.outliers.begin(), result.outliers.end()));
  CHECK(std::adjacent_find(result.outliers.begin(), result.outliers.end()) == result.outliers.end());
  double index_sum = 0;
  Point mean = Point::Zero(), normal_mean = Point::Zero(), low = Point::Constant(9), high = Point::Constant(-9);
  for (const auto i : result.outliers) {
    CHECK(result.truth[std::size_t(i)].place.face == -1);
    CHECK(result.truth[std::size_t(i)].camera == -1);
    index_sum += double(i);
    mean += result.scan.points.row(i) / 2000;
    normal_mean += result.scan.normals.row(i) / 2000;
    low = low.cwiseMin(result.scan.points.row(i));
    high = high.cwiseMax(result.scan.points.row(i));
  }
  CHECK(index_sum / 2000 == Approx(10000).margin(600));
  CHECK(mean.norm() < 0.1);
  CHECK(normal_mean.norm() < 0.06);
  const Point box = mesh.vertices.colwise().maxCoeff();
  for (int axis = 0; axis < 3; ++axis) {
    CHECK(low[axis] > -box[axis] - 0.5);
    CHECK(low[axis] < -box[axis] - 0.48);
    CHECK(high[axis] < box[axis] + 0.5);
    CHECK(high[axis] > box[axis] + 0.48);
  }
  CHECK(std::count_if(result.truth.begin(), result.truth.end(), [](const auto& p) { return p.place.face < 0; }) ==
        2000);
}

TEST_CASE("holes and cuts take the asked share, whole regions of it, and say which") {
  const auto mesh = sphere(4);
  auto options = exactOptions(10000);
  const auto whole = scanVirtually(mesh.vertices, mesh.faces, options);
  struct Case {
    double holes, cut;
    Eigen::Index left;
  };
  for (const auto& [holes, cut, left] : {Case{0.3, 0, 7000}, Case{0, 0.25, 7500}, Case{0.5, 0.4, 1000}}) {
    options.holes = holes;
    options.cut = cut;
    options.hole_radius = 0.2;
    const auto result = scanVirtually(mesh.vertices, mesh.faces, options);
    CHECK(result.scan.points.rows() == left);
    CHECK(result.truth.size() == std::size_t(left));
    CHECK(result.cut.has_value() == (cut > 0));
    CHECK(result.holes.empty() == (holes == 0));
    CHECK(result.visible_fraction == whole.visible_fraction);
    const auto gone = [&](const Point& point) {
      return (result.cut && result.cut->normal.dot(point) > result.cut->offset) ||
             std::any_of(result.holes.begin(), result.holes.end(),
                         [&](const ScanHole& hole) { return (point - hole.centre).norm() < hole.radius; });
    };
    Eigen::Index next = 0;
    for (Eigen::Index i = 0; i < 10000; ++i) {
      const Point point = whole.scan.points.row(i);
      if (!gone(point)) REQUIRE(result.scan.points.row(next++) == point);
    }
    CHECK(next == left);
    for (const auto& hole : result.holes) CHECK(hole.radius <= 0.3);
  }
}

TEST_CASE("the motion of a virtual scan is as reported") {
  const auto mesh = sphere(3);
  auto options = exactOptions(500);
  const auto still = scanVirtually(mesh.vertices, mesh.faces, options);
  options.motion.reset();
  double largest_tilt = 0, smallest_tilt = 9;
  Point mean_facing = Point::Zero();
  for (options.seed = 1; options.seed <= 40; ++options.seed) {
    options.motion.reset();
    const auto moved = scanVirtually(mesh.vertices, mesh.faces, options);
    CHECK((moved.motion.rotation.transpose() * moved.motion.rotation - Eigen::Matrix3d::Identity()).norm() < 1e-14);
    CHECK(moved.motion.rotation.determinant() == Approx(1));
    CHECK(moved.motion.translation.cwiseAbs().maxCoeff() <= 1);
    const double tilt = std::acos(moved.motion.rotation(1, 1)) * 180 / std::numbers::pi;
    largest_tilt = std::max(largest_tilt, tilt);
    smallest_tilt = std::min(smallest_tilt, tilt);
    mean_facing += moved.motion.rotation.col(2).transpose() / 40;
    options.motion = RigidMotion{};
    const auto same = scanVirtually(mesh.vertices, mesh.faces, options);
    CHECK((apply(moved.motion, same.scan.points) - moved.scan.points).cwiseAbs().maxCoeff() < 1e-14);
    CHECK((same.scan.normals * moved.motion.rotation.transpose() - moved.scan.normals).cwiseAbs().maxCoeff() < 1e-14);
  }
  CHECK(largest_tilt < 20);
  CHECK(largest_tilt > 17);
  CHECK(smallest_tilt < 3);
  CHECK(mean_facing.norm() < 0.5);

  options.motion.reset();
  options.any_rotation = true;
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (options.seed = 1; options.seed <= 60; ++options.seed)
    up += scanVirtually(mesh.vertices, mesh.faces, options).motion.rotation.col(1) / 60;
  CHECK(up.norm() < 0.35);

  options.motion = RigidMotion{Eigen::AngleAxisd(1, Eigen::Vector3d::UnitX()).toRotationMatrix(), {1, 2, 3}};
  const auto given = scanVirtually(mesh.vertices, mesh.faces, options);
  CHECK(given.motion.rotation == options.motion->rotation);
  CHECK(given.motion.translation == options.motion->translation);
}

TEST_CASE("what the virtual scanner cannot do is refused by name") {
  const auto mesh = sphere(1);
  const auto refused = [&](auto change, const char* text) {
    VirtualScannerOptions options;
    change(options);
    CHECK_THROWS_AS(scanVirtually(mesh.vertices, mesh.faces, options), InvalidInput);
    CHECK_THROWS_WITH(scanVirtually(mesh.vertices, mesh.faces, options), Contains(text));
  };
  using Options = VirtualScannerOptions;
  refused([](Options& o) { o.points = 0; }, "options: points = 0, want 1 to 1000000");
  refused([](Options& o) { o.cameras = 0; }, "cameras = 0, want 1 to 1000");
  refused([](Options& o) { o.noise = -1; }, "noise = -1.000000, want >= 0");
  refused([](Options& o) { o.noise = std::nan(""); }, "noise = nan");
  refused([](Options& o) { o.outliers = 0.95; }, "outliers = 0.950000, want 0 to 0.9");
  refused([](Options& o) { o.holes = o.cut = 0.5; }, "holes + cut = 1.000000, want 0 to 0.9");
  refused([](Options& o) { o.hole_radius = 0; }, "hole_radius = 0.000000, want > 0");
  refused(
      [](Options& o) {
        o.motion = RigidMotion{2 * Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()};
      },
      "want a rigid motion");
  refused([](Options& o) { o.ring_radius = 0.1; }, "vertices: the cameras see next to nothing of the mesh");

  Faces inward = mesh.faces;
  inward.col(0).swap(inward.col(1));
  CHECK_THROWS_WITH(scanVirtually(mesh.vertices, inward), Contains("vertices: the cameras see next to nothing"));
  CHECK_THROWS_WITH(scanVirtually(mesh.vertices, Faces(0, 3)), Contains("faces: there are none"));
  Faces broken = mesh.faces;
  broken(3, 1) = 99;
  CHECK_THROWS_WITH(scanVirtually(mesh.vertices, broken), Contains("faces[3]: has an index outside [0, 42)"));
  Vertices holed = mesh.vertices;
  holed(5, 2) = std::nan("");
  CHECK_THROWS_WITH(scanVirtually(holed, mesh.faces), Contains("vertices[5]: has a coordinate that is not finite"));
  CHECK_THROWS_WITH(scanVirtually(Vertices::Zero(42, 3), mesh.faces), Contains("faces: no face has area"));
}

TEST_CASE("virtual scans of real bodies are as those of the body data set", "[data]") {
  const auto folder = test::realData("body_scans");
  if (!folder) return;
  const auto description = nlohmann::json::parse(std::ifstream(*folder / "scans.json"));
  for (const int index : {0, 3, 10, 22}) {
    const auto& entry = description["scans"][std::size_t(index)];
    const auto mesh = readMesh(*folder / entry["gt"].get<std::string>());
    VirtualScannerOptions options;
    options.points = entry["points"];
    const auto ours = scanVirtually(mesh.vertices, mesh.faces, options);
    INFO(index);
    CHECK(ours.visible_fraction == Approx(entry["visible_fraction"].get<double>()).margin(0.006));
    CHECK(std::abs(double(ours.outliers.size()) - double(entry["outlier_indices"].size())) <= 1);

    RigidMotion motion;
    for (int i = 0; i < 3; ++i) {
      motion.translation[i] = entry["t"][std::size_t(i)];
      for (int j = 0; j < 3; ++j) motion.rotation(i, j) = entry["R"][std::size_t(i)][std::size_t(j)];
    }
    const auto theirs = sortedDistances(readScan(*folder / entry["scan"].get<std::string>()), motion,
                                        entry["outlier_indices"].get<std::vector<Eigen::Index>>(), mesh);
    const auto mine = sortedDistances(ours.scan, ours.motion, ours.outliers, mesh);
    CAPTURE(ours.visible_fraction, quantile(mine, 0.5), quantile(theirs, 0.5), quantile(mine, 0.9),
            quantile(theirs, 0.9), quantile(mine, 0.99), quantile(theirs, 0.99));
    for (const double share : {0.25, 0.5, 0.75, 0.9, 0.99})
      CHECK(quantile(mine, share) == Approx(quantile(theirs, share)).epsilon(0.1));
  }
}
