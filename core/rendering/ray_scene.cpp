#include "core/rendering/ray_scene.h"

#include <embree3/rtcore.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "core/mesh/quality.h"

namespace shaped {
namespace {

RTCRay makeRay(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double nearest) {
  RTCRay ray{};
  ray.org_x = static_cast<float>(origin.x());
  ray.org_y = static_cast<float>(origin.y());
  ray.org_z = static_cast<float>(origin.z());
  ray.dir_x = static_cast<float>(direction.x());
  ray.dir_y = static_cast<float>(direction.y());
  ray.dir_z = static_cast<float>(direction.z());
  ray.tnear = static_cast<float>(nearest);
  ray.tfar = std::numeric_limits<float>::infinity();
  ray.mask = ~0u;
  return ray;
}

/// The hit raised onto the planes that its corners' normals span, never below the triangle: flat triangles of a smooth
/// surface would else shadow themselves in steps (Hanika, "Hacking the shadow terminator", Ray Tracing Gems II).
Eigen::RowVector3d liftedPosition(const Eigen::RowVector3d& position, const Eigen::RowVector3d& barycentric,
                                  const Eigen::Matrix3d& corners, const Eigen::Matrix3d& normals) {
  Eigen::RowVector3d lifted = position;
  for (int c = 0; c < 3; ++c) {
    const double below = std::min(0.0, (position - corners.row(c)).dot(normals.row(c)));
    lifted -= barycentric[c] * below * normals.row(c);
  }
  return lifted;
}

}  // namespace

struct RayScene::Embree {
  RTCDevice device = rtcNewDevice("threads=1");
  RTCScene scene = rtcNewScene(device);

  Embree(const Vertices& vertices, const Faces& faces) {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* positions = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), std::size_t(vertices.rows())));
    std::copy_n(vertices.data(), vertices.size(), positions);
    auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                   3 * sizeof(unsigned), std::size_t(faces.rows())));
    std::copy_n(faces.data(), faces.size(), indices);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcCommitScene(scene);
  }

  ~Embree() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }

  Embree(const Embree&) = delete;
  Embree& operator=(const Embree&) = delete;
};

RayScene::RayScene(const Vertices& vertices, const Faces& faces, double floor)
    : vertices_(vertices),
      normals_(vertexNormals(faces, vertices)),
      faces_(faces),
      radius_(0.5 * (vertices.colwise().maxCoeff() - vertices.colwise().minCoeff()).norm()),
      floor_(floor),
      embree_(std::make_unique<Embree>(vertices, faces)) {}

RayScene::~RayScene() = default;

std::optional<RayHit> RayScene::firstHit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
  RTCRayHit query{makeRay(origin, direction, 0), {}};
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(embree_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;

  RayHit hit;
  hit.face = static_cast<std::int32_t>(query.hit.primID);
  hit.barycentric << 1.0 - query.hit.u - query.hit.v, query.hit.u, query.hit.v;
  Eigen::Matrix3d corners, normals;
  for (int c = 0; c < 3; ++c) {
    corners.row(c) = vertices_.row(faces_(hit.face, c));
    normals.row(c) = normals_.row(faces_(hit.face, c));
  }
  hit.position = (hit.barycentric * corners).transpose();
  hit.face_normal =
      Eigen::Vector3d((corners.row(1) - corners.row(0)).cross(corners.row(2) - corners.row(0))).normalized();
  hit.smooth_normal = (hit.barycentric * normals).transpose().normalized();
  hit.back_face = hit.face_normal.dot(direction) > 0;
  hit.lifted = liftedPosition(hit.position.transpose(), hit.barycentric, corners, normals).transpose();
  return hit;
}

bool RayScene::occluded(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
  RTCRay ray = makeRay(origin, direction, 2e-4 * radius_);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(embree_->scene, &context, &ray);
  return ray.tfar < 0;
}

}  // namespace shaped
