#include "core/sample/virtual_scanner.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/rendering/ray_scene.h"
#include "core/sample/random_direction.h"

namespace shaped {
namespace {

/// Share of its distance by which a ray may end short of the point: rounding of the ray caster's floats.
constexpr double kDepthTolerance = 1e-4;

constexpr double radians(double degrees) { return degrees * std::numbers::pi / 180; }

/// The cameras and what stands between them and the mesh.
class CameraRing {
 public:
  CameraRing(const Vertices& vertices, const Faces& faces, const VirtualScannerOptions& options)
      : scene_(vertices, faces, 0),
        positions_(cameraPositions(vertices, options)),
        normals_(faceNormals(faces, vertices)),
        smallest_cosine_(options.smallest_cosine) {}

  /// One of the cameras that see a point of a face, drawn by how densely their pixels cover it: as the cosine there.
  /// Nothing where none sees it. Takes one number of the sequence.
  std::optional<int> draw(const Eigen::RowVector3d& point, std::int32_t face, Random& random) const {
    Eigen::VectorXd weights(positions_.rows());
    for (int camera = 0; camera < positions_.rows(); ++camera) {
      const double cosine = -ray(camera, point).dot(normals_.row(face));
      weights[camera] = cosine > smallest_cosine_ && !hidden(camera, point, face) ? cosine : 0;
    }
    double target = random.uniform() * weights.sum();
    std::optional<int> last;
    for (int camera = 0; camera < positions_.rows(); ++camera) {
      if (weights[camera] > 0) last = camera;
      if ((target -= weights[camera]) < 0) return camera;
    }
    return last;  // where rounding left a little of the target
  }

  /// Unit vector from a camera to a point.
  Eigen::RowVector3d ray(int camera, const Eigen::RowVector3d& point) const {
    return (point - positions_.row(camera)).normalized();
  }

 private:
  bool hidden(int camera, const Eigen::RowVector3d& point, std::int32_t face) const {
    const Eigen::RowVector3d eye = positions_.row(camera);
    const auto hit = scene_.firstHit(eye.transpose(), ray(camera, point).transpose());
    if (!hit || hit->face == face) return false;
    return (hit->position.transpose() - eye).norm() < (1 - kDepthTolerance) * (point - eye).norm();
  }

  RayScene scene_;
  Vertices positions_, normals_;
  double smallest_cosine_;
};

/// A unit normal turned by a normally distributed angle in each of two tangent directions.
Eigen::RowVector3d tilted(const Eigen::RowVector3d& normal, double deviation, Random& random) {
  const Eigen::Vector3d n = normal.transpose(), s = n.unitOrthogonal(), t = n.cross(s);
  const double a = deviation * random.normal(), b = deviation * random.normal(), angle = std::hypot(a, b);
  if (angle == 0) return normal;
  return (std::cos(angle) * n + std::sin(angle) / angle * (a * s + b * t)).transpose().normalized();
}

/// Points of the surface as the cameras measure them, in the mesh's frame.
struct Measured {
  std::vector<ScannedPoint> truth;
  Vertices exact, points, normals;
  double visible_fraction = 0;
};

class Measuring {
 public:
  Measuring(const Vertices& vertices, const Faces& faces, const VirtualScannerOptions& options)
      : vertices_(vertices),
        faces_(faces),
        options_(options),
        sampler_(vertices, faces),
        ring_(vertices, faces, options),
        vertex_normals_(vertexNormals(faces, vertices)),
        face_normals_(faceNormals(faces, vertices)) {}

  Measured operator()(Eigen::Index count, Random& random) const {
    Measured measured{{}, Vertices(count, 3), Vertices(count, 3), Vertices(count, 3)};
    std::int64_t tries = 0;
    for (Eigen::Index found = 0; found < count; ++tries) {
      if (tries >= 10000 && tries > 1000 * found)
        throw InvalidInput("vertices",
                           "the cameras see next to nothing of the mesh; want a closed mesh with outward "
                           "faces within a ring of " +
                               std::to_string(options_.ring_radius) + " m");
      Random own(random.bits());
      if (measure(own, found, measured)) ++found;
    }
    measured.visible_fraction = tries > 0 ? double(count) / double(tries) : 0;
    return measured;
  }

 private:
  /// Tries one place of the surface; false where no camera sees it.
  bool measure(Random& random, Eigen::Index row, Measured& measured) const {
    const auto place = sampler_(random);
    const Eigen::RowVector3d exact = at(place, faces_, vertices_);
    const auto camera = ring_.draw(exact, place.face, random);
    if (!camera) return false;
    measured.truth.push_back({place, *camera});
    measured.exact.row(row) = exact;
    measured.points.row(row) = exact + options_.noise * random.normal() * ring_.ray(*camera, exact);
    measured.normals.row(row) = tilted(smoothNormal(place), radians(options_.normal_noise), random);
    return true;
  }

  Eigen::RowVector3d smoothNormal(const SurfaceSample& place) const {
    const Eigen::RowVector3d mean = at(place, faces_, vertex_normals_);
    return mean.norm() > 1e-6 ? Eigen::RowVector3d(mean.normalized()) : face_normals_.row(place.face);
  }

  const Vertices& vertices_;
  const Faces& faces_;
  const VirtualScannerOptions& options_;
  SurfaceSampler sampler_;
  CameraRing ring_;
  Vertices vertex_normals_, face_normals_;
};

/// Takes a share of the measured points away, by a cut and by holes.
void makeGaps(const VirtualScannerOptions& options, Measured& measured, VirtualScan& result, Random& random) {
  const Eigen::Index count = measured.exact.rows();
  std::vector<bool> left(std::size_t(count), true);
  result.cut = cutAway(measured.exact, Eigen::Index(options.cut * double(count)), random, left);
  result.holes =
      punchHoles(measured.exact, Eigen::Index(options.holes * double(count)), options.hole_radius, random, left);
  Eigen::Index kept = 0;
  for (Eigen::Index i = 0; i < count; ++i) {
    if (!left[std::size_t(i)]) continue;
    measured.truth[std::size_t(kept)] = measured.truth[std::size_t(i)];
    measured.points.row(kept) = measured.points.row(i);
    measured.normals.row(kept) = measured.normals.row(i);
    ++kept;
  }
  measured.truth.resize(std::size_t(kept));
  measured.points.conservativeResize(kept, 3);
  measured.normals.conservativeResize(kept, 3);
}

/// Mixes outliers into the measured points: every set of places among them is as likely (selection sampling, Knuth, The
/// Art of Computer Programming 2, algorithm 3.4.2 S).
void addOutliers(Eigen::Index outliers, const Vertices& vertices, double margin, const Measured& measured,
                 VirtualScan& result, Random& random) {
  const Eigen::Index total = measured.points.rows() + outliers;
  const Eigen::RowVector3d low = vertices.colwise().minCoeff().array() - margin;
  const Eigen::RowVector3d high = vertices.colwise().maxCoeff().array() + margin;
  result.scan.points.resize(total, 3);
  result.scan.normals.resize(total, 3);
  for (Eigen::Index i = 0, next = 0; i < total; ++i) {
    const Eigen::Index missing = outliers - Eigen::Index(result.outliers.size());
    if (random.uniform() * double(total - i) < double(missing)) {
      for (int axis = 0; axis < 3; ++axis) result.scan.points(i, axis) = random.uniform(low[axis], high[axis]);
      result.scan.normals.row(i) = randomDirection(random).transpose();
      result.outliers.push_back(i);
      result.truth.emplace_back();
      continue;
    }
    result.scan.points.row(i) = measured.points.row(next);
    result.scan.normals.row(i) = measured.normals.row(next);
    result.truth.push_back(measured.truth[std::size_t(next++)]);
  }
}

Eigen::Matrix3d randomRotation(const VirtualScannerOptions& options, Random& random) {
  if (options.any_rotation) {
    // The direction of a normally distributed vector of four is even over the unit quaternions.
    Eigen::Vector4d q;
    for (double& coordinate : q) coordinate = random.normal();
    return Eigen::Quaterniond(q.normalized()).toRotationMatrix();
  }
  const double yaw = random.uniform(0, 2 * std::numbers::pi), azimuth = random.uniform(0, 2 * std::numbers::pi);
  const double tilt = random.uniform(0, radians(options.largest_tilt));
  const Eigen::AngleAxisd turn(yaw, Eigen::Vector3d::UnitY());
  return (Eigen::AngleAxisd(tilt, Eigen::Vector3d(std::cos(azimuth), 0, std::sin(azimuth))) * turn).toRotationMatrix();
}

RigidMotion motionOf(const VirtualScannerOptions& options, Random& random) {
  if (options.motion) return *options.motion;
  RigidMotion motion;
  motion.rotation = randomRotation(options, random);
  for (double& shift : motion.translation) shift = random.uniform(-options.largest_shift, options.largest_shift);
  return motion;
}

bool isRigid(const RigidMotion& motion) {
  const Eigen::Matrix3d& r = motion.rotation;
  return r.allFinite() && motion.translation.allFinite() && r.determinant() > 0 &&
         (r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-9;
}

std::string violation(const char* name, double value, const char* wanted) {
  return std::string(name) + " = " + std::to_string(value) + ", want " + wanted;
}

}  // namespace

std::optional<std::string> VirtualScannerOptions::firstViolation() const {
  if (cameras < 1 || cameras > 1000) return "cameras = " + std::to_string(cameras) + ", want 1 to 1000";
  if (points < 1 || points > 1000000) return "points = " + std::to_string(points) + ", want 1 to 1000000";
  struct Range {
    const char* name;
    double value, low, high;
    const char* wanted;
  };
  constexpr double most = 1e6;
  for (const auto& [name, value, low, high, wanted] : {
           Range{"ring_radius", ring_radius, 1e-6, most, "> 0"},
           Range{"below", below, -most, most, "a finite number"},
           Range{"above", above, -most, most, "a finite number"},
           Range{"smallest_cosine", smallest_cosine, 0, 1, "0 to 1"},
           Range{"noise", noise, 0, most, ">= 0"},
           Range{"normal_noise", normal_noise, 0, 90, "0 to 90"},
           Range{"outliers", outliers, 0, 0.9, "0 to 0.9"},
           Range{"outlier_box", outlier_box, 0, most, ">= 0"},
           Range{"holes", holes, 0, 0.9, "0 to 0.9"},
           Range{"hole_radius", hole_radius, 1e-6, most, "> 0"},
           Range{"cut", cut, 0, 0.9, "0 to 0.9"},
           Range{"holes + cut", holes + cut, 0, 0.9, "0 to 0.9"},
           Range{"largest_tilt", largest_tilt, 0, 180, "0 to 180"},
           Range{"largest_shift", largest_shift, 0, most, ">= 0"},
       })
    if (!(value >= low && value <= high)) return violation(name, value, wanted);
  if (motion && !isRigid(*motion)) return "motion = no rotation and finite translation, want a rigid motion";
  return std::nullopt;
}

Vertices cameraPositions(const Vertices& vertices, const VirtualScannerOptions& options) {
  const Eigen::RowVector3d middle = 0.5 * (vertices.colwise().minCoeff() + vertices.colwise().maxCoeff());
  Vertices positions(options.cameras, 3);
  for (int camera = 0; camera < options.cameras; ++camera) {
    const double azimuth = 2 * std::numbers::pi * camera / options.cameras;
    const double height = camera % 2 == 0 ? -options.below : options.above;
    positions.row(camera) = middle + Eigen::RowVector3d(options.ring_radius * std::sin(azimuth), height,
                                                        options.ring_radius * std::cos(azimuth));
  }
  return positions;
}

VirtualScannerOptions scannerFor(double extent) {
  VirtualScannerOptions options;
  for (double* length : {&options.ring_radius, &options.below, &options.above, &options.noise, &options.outlier_box,
                         &options.hole_radius, &options.largest_shift})
    *length *= extent / 2;
  return options;
}

VirtualScan scanVirtually(const Vertices& vertices, const Faces& faces, const VirtualScannerOptions& options) {
  if (const auto problem = options.firstViolation()) throw InvalidInput("options", *problem);
  // A sequence for each purpose: another share of outliers leaves the surface's points and the motion as they are.
  Random seeds(options.seed), surface(seeds.bits()), gaps(seeds.bits()), clutter(seeds.bits()), moving(seeds.bits());
  const Eigen::Index outliers = std::llround(options.outliers * options.points);
  VirtualScan result;
  auto measured = Measuring(vertices, faces, options)(options.points - outliers, surface);
  result.visible_fraction = measured.visible_fraction;
  makeGaps(options, measured, result, gaps);
  addOutliers(outliers, vertices, options.outlier_box, measured, result, clutter);
  result.motion = motionOf(options, moving);
  result.scan.points = apply(result.motion, result.scan.points);
  result.scan.normals = (result.scan.normals * result.motion.rotation.transpose()).eval();
  return result;
}

}  // namespace shaped
