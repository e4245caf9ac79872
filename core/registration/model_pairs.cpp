#include "core/registration/model_pairs.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

#include "core/mesh/quality.h"
#include "core/registration/surface_samples.h"
#include "core/skeleton/foremost_joint.h"

namespace shaped {
namespace {

/// A fixed random order of 0 .. n - 1, the same with every standard library.
std::vector<std::int32_t> shuffled(std::int32_t n) {
  std::vector<std::int32_t> order(static_cast<std::size_t>(n));
  std::iota(order.begin(), order.end(), 0);
  std::minstd_rand random(1);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random() % i]);
  return order;
}

double middle(std::vector<double>& values, double share) {
  if (values.empty()) return 0;
  const auto at = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

ModelPairs::ModelPairs(const ScanSurface& scan, const BodyModel& model, const ModelFitOptions& options)
    : scan_(scan),
      model_(model),
      options_(options),
      least_cosine_(std::cos(options.max_normal_angle * std::numbers::pi / 180)),
      scan_order_(shuffled(std::int32_t(scan.points().rows()))) {
  for (Eigen::Index v = 0; v < model.parts().mean.rows(); ++v)
    region_.push_back(foremostJoint(model.parts().weights, v));
}

bool ModelPairs::facing(const Eigen::RowVector3d& scan_normal, const Eigen::RowVector3d& model_normal) const {
  if (scan_normal.isZero(0) || model_normal.isZero(0)) return true;
  const double cosine = scan_normal.dot(model_normal);
  return (scan_.hasOrientedNormals() ? cosine : std::abs(cosine)) >= least_cosine_;
}

std::vector<SurfaceTarget> ModelPairs::find(const Vertices& surface, const ModelFitLevel& level) const {
  const Vertices normals = vertexNormals(model_.topology()->faces(), surface);
  std::vector<SurfaceTarget> targets;
  addFromModel(surface, normals, level, targets);
  addFromScan(surface, normals, level, targets);
  return targets;
}

void ModelPairs::addFromModel(const Vertices& surface, const Vertices& normals, const ModelFitLevel& level,
                              std::vector<SurfaceTarget>& targets) const {
  const RobustLoss loss{RobustLoss::Kind::kGemanMcClure, level.loss_scale};
  const auto chosen = verticesByArea(model_.topology()->faces(), model_.parts().mean, level.points);
  for (const std::int32_t v : chosen) {
    const ScanPoint found = scan_.closest(surface.row(v));
    if (found.distance > level.max_distance || (options_.reject_boundary && found.boundary) ||
        !facing(found.normal, normals.row(v)))
      continue;
    SurfaceTarget target{{v, v, v}, Eigen::Vector3d::UnitX(), found.position.transpose()};
    if (level.to_planes) target.normal = found.normal.transpose();
    target.weight = loss.weight(found.distance * found.distance) / double(chosen.size());
    targets.push_back(target);
  }
}

void ModelPairs::addFromScan(const Vertices& surface, const Vertices& normals, const ModelFitLevel& level,
                             std::vector<SurfaceTarget>& targets) const {
  const RobustLoss loss{RobustLoss::Kind::kGemanMcClure, level.loss_scale};
  const auto& faces = model_.topology()->faces();
  const ClosestPointQuery closest(surface, faces);
  const std::size_t count = std::min(scan_order_.size(), std::size_t(level.points));
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::RowVector3d point = scan_.points().row(scan_order_[i]);
    const SurfacePoint found = closest(point);
    if (found.distance > level.max_distance) continue;
    Eigen::RowVector3d normal = Eigen::RowVector3d::Zero();
    for (int c = 0; c < 3; ++c) normal += found.barycentric[c] * normals.row(faces(found.face, c));
    normal.normalize();
    if (!facing(scan_.normals().row(scan_order_[i]), normal)) continue;
    SurfaceTarget target{{faces(found.face, 0), faces(found.face, 1), faces(found.face, 2)},
                         found.barycentric.transpose(),
                         point.transpose()};
    if (level.to_planes) target.normal = normal.transpose();
    target.weight = loss.weight(found.distance * found.distance) / double(count);
    targets.push_back(target);
  }
}

ModelFitReport ModelPairs::report(const Vertices& surface, const ModelFitLevel& level) const {
  const Vertices normals = vertexNormals(model_.topology()->faces(), surface);
  ModelFitReport report;
  reportModel(surface, normals, level, report);
  reportScan(surface, normals, level, report);
  return report;
}

void ModelPairs::reportModel(const Vertices& surface, const Vertices& normals, const ModelFitLevel& level,
                             ModelFitReport& report) const {
  const auto& skeleton = model_.skeleton();
  std::vector<double> all(std::size_t(skeleton.jointCount())), seen(all), sums(all);
  double ungated = 0, total = 0, total_seen = 0;
  for (std::int32_t v = 0; v < surface.rows(); ++v) {
    const auto region = std::size_t(region_[std::size_t(v)]);
    const ScanPoint found = scan_.closest(surface.row(v));
    all[region] += 1;
    ungated += found.distance;
    if (found.distance > level.max_distance || (options_.reject_boundary && found.boundary) ||
        !facing(found.normal, normals.row(v)))
      continue;
    seen[region] += 1;
    const double across =
        found.normal.isZero(0) ? found.distance : std::abs(found.normal.dot(surface.row(v) - found.position));
    sums[region] += across;
    total += across;
    total_seen += 1;
  }
  for (std::int32_t j = 0; j < skeleton.jointCount(); ++j) {
    const auto region = std::size_t(j);
    if (all[region] > 0)
      report.regions.push_back(
          {skeleton.name(j), seen[region] / all[region], seen[region] > 0 ? sums[region] / seen[region] : 0});
  }
  report.seen = total_seen / double(surface.rows());
  report.model_mean = total_seen > 0 ? total / total_seen : 0;
  report.chamfer += ungated / double(surface.rows());
}

void ModelPairs::reportScan(const Vertices& surface, const Vertices& normals, const ModelFitLevel& level,
                            ModelFitReport& report) const {
  const auto& faces = model_.topology()->faces();
  const ClosestPointQuery closest(surface, faces);
  std::vector<double> distances;
  double explained = 0, sum = 0;
  for (Eigen::Index i = 0; i < scan_.points().rows(); ++i) {
    const SurfacePoint found = closest(scan_.points().row(i));
    Eigen::RowVector3d normal = Eigen::RowVector3d::Zero();
    for (int c = 0; c < 3; ++c) normal += found.barycentric[c] * normals.row(faces(found.face, c));
    distances.push_back(found.distance);
    sum += found.distance;
    if (found.distance <= level.max_distance && facing(scan_.normals().row(i), normal.normalized())) explained += 1;
  }
  const double count = double(distances.size());
  report.scan_mean = sum / count;
  report.scan_median = middle(distances, 0.5);
  report.scan_95 = middle(distances, 0.95);
  report.explained = explained / count;
  report.chamfer += report.scan_mean;
}

}  // namespace shaped
