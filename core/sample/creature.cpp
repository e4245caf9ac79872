#include "core/sample/creature.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/sample/implicit_body.h"
#include "core/sample/isotropic_remeshing.h"
#include "core/sample/marching_tetrahedra.h"
#include "core/sample/random.h"
#include "core/sample/skin_weights.h"

namespace shaped {
namespace {

/// Wanted edge length relative to the mean: thin limbs get smaller triangles than the trunk.
double relativeSize(const ImplicitBody& body, const Eigen::Vector3d& point) {
  return std::clamp(std::sqrt(body.thickness(point) / 0.06), 0.55, 1.25);
}

/// The edge length that relative size 1 must have so that `count` vertices cover the surface: a vertex of a regular
/// triangulation stands for sqrt(3)/2 squared edges of area.
double unitEdge(const SurfaceMesh& mesh, const ImplicitBody& body, int count) {
  const Eigen::VectorXd areas = triangleAreas(mesh.faces, mesh.vertices);
  double weighted = 0;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (int c = 0; c < 3; ++c) middle += mesh.vertices.row(mesh.faces(f, c)).transpose() / 3;
    const double size = relativeSize(body, middle);
    weighted += areas[f] / (size * size);
  }
  return std::sqrt(weighted / (0.5 * std::sqrt(3.0) * count));
}

SurfaceMesh meshBody(const ImplicitBody& body, int vertex_count) {
  const auto [low, high] = body.bounds();
  const SurfaceMesh fine = marchTetrahedra([&](const Eigen::Vector3d& x) { return body.value(x); }, low, high,
                                           0.014 * std::sqrt(std::min(1.0, 1500.0 / vertex_count)));
  const auto project = [&](const Eigen::Vector3d& x) { return body.project(x); };
  double edge = unitEdge(fine, body, vertex_count);
  SurfaceMesh mesh;
  // Remeshing ends with edges off the wish by much the same share every time: a second pass corrects the count.
  for (int pass = 0; pass < 2; ++pass) {
    const auto edge_length = [&](const Eigen::Vector3d& x) { return edge * relativeSize(body, x); };
    mesh = remeshIsotropically(fine, edge_length, project);
    edge *= std::sqrt(static_cast<double>(mesh.vertices.rows()) / vertex_count);
  }
  return mesh;
}

/// What a bone does to the space around it when its place, length and thickness change.
Eigen::Affine3d boneChange(const Bone& before, const Bone& after) {
  const Eigen::Vector3d from = before.end - before.joint, to = after.end - after.joint;
  const double along = to.norm() / from.norm();
  const double across = (after.joint_radius + after.end_radius) / (before.joint_radius + before.end_radius);
  const Eigen::Vector3d axis = from.normalized();
  const Eigen::Matrix3d stretch = across * Eigen::Matrix3d::Identity() + (along - across) * axis * axis.transpose();
  Eigen::Affine3d change;
  change.linear() = Eigen::Quaterniond::FromTwoVectors(from, to).toRotationMatrix() * stretch;
  change.translation() = after.joint - change.linear() * before.joint;
  return change;
}

}  // namespace

std::optional<std::string> CreatureOptions::firstViolation() const {
  if (vertices < 600 || vertices > 20000) return "vertices = " + std::to_string(vertices) + ", want 600 to 20000";
  if (const auto problem = proportions.firstViolation()) return "proportions." + *problem;
  return std::nullopt;
}

SampleCreature makeCreature(const CreatureOptions& options) {
  if (const auto problem = options.firstViolation()) throw InvalidInput("options", *problem);
  const auto bones = makeSkeleton({});
  const SurfaceMesh mesh = meshBody(ImplicitBody(bones), options.vertices);
  SampleCreature creature{std::make_shared<const Topology>(std::int32_t(mesh.vertices.rows()), mesh.faces),
                          mesh.vertices, bones, heatSkinWeights(mesh.vertices, mesh.faces, bones)};
  return withProportions(creature, options.proportions);
}

SampleCreature withProportions(const SampleCreature& creature, const Proportions& proportions) {
  SampleCreature result = creature;
  result.bones = makeSkeleton(proportions);
  const ImplicitBody body(result.bones);
  std::vector<Eigen::Affine3d> changes;
  for (std::size_t b = 0; b < creature.bones.size(); ++b)
    changes.push_back(boneChange(creature.bones[b], result.bones[b]));
  for (Eigen::Index v = 0; v < creature.rest.rows(); ++v) {
    const Eigen::Vector3d rest = creature.rest.row(v).transpose();
    Eigen::Vector3d moved = Eigen::Vector3d::Zero();
    for (std::size_t b = 0; b < changes.size(); ++b)
      moved += creature.weights(v, Eigen::Index(b)) * (changes[b] * rest);
    result.rest.row(v) = body.project(moved).transpose();
  }
  return result;
}

Proportions randomProportions(std::uint64_t seed, double spread) {
  Random random(seed);
  const auto factor = [&] { return std::clamp(1 + spread * random.normal(), 0.75, 1.3); };
  Proportions p;
  for (double* field : {&p.body_length, &p.body_thickness, &p.neck_length, &p.head_size, &p.leg_length,
                        &p.leg_thickness, &p.tail_length, &p.tail_thickness, &p.ear_length})
    *field = factor();
  return p;
}

}  // namespace shaped
