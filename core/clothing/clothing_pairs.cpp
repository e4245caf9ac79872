#include "core/clothing/clothing_pairs.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "core/mesh/quality.h"
#include "core/registration/landmark_targets.h"
#include "core/registration/surface_samples.h"

namespace shaped {
namespace {

constexpr int kScanPoints = 1500;  ///< of the scan that misfit looks at

double bounded(double distance, double scale) { return distance * distance / (scale * scale + distance * distance); }

}  // namespace

ClothingPairs::ClothingPairs(const ScanSurface& scan, const BodyModel& model, const std::vector<Landmark>& landmarks,
                             const ClothingOptions& options)
    : scan_(scan),
      model_(model),
      landmarks_(landmarks),
      options_(options),
      chosen_(verticesByArea(model.topology()->faces(), model.parts().mean, options.points)) {}

std::optional<ClothingPairs::Pair> ClothingPairs::pairOf(const Vertices& surface, const Vertices& normals,
                                                         std::int32_t vertex) const {
  const ScanPoint found = scan_.closest(surface.row(vertex));
  if (found.distance > options_.max_distance || found.boundary || found.normal.isZero(0)) return std::nullopt;
  Pair pair{found.position, found.normal, 0};
  double cosine = pair.normal.dot(normals.row(vertex));
  if (!scan_.hasOrientedNormals() && cosine < 0) {
    pair.normal = -pair.normal;
    cosine = -cosine;
  }
  if (cosine < std::cos(options_.max_normal_angle * std::numbers::pi / 180)) return std::nullopt;
  pair.height = pair.normal.dot(surface.row(vertex) - pair.position);
  return pair;
}

Eigen::VectorXd ClothingPairs::gaps(const Vertices& surface) const {
  const Vertices normals = vertexNormals(model_.topology()->faces(), surface);
  Eigen::VectorXd gaps(Eigen::Index(chosen_.size()));
  for (std::size_t i = 0; i < chosen_.size(); ++i) {
    const auto pair = pairOf(surface, normals, chosen_[i]);
    gaps[Eigen::Index(i)] = pair ? -pair->height : std::numeric_limits<double>::quiet_NaN();
  }
  return gaps;
}

std::vector<SurfaceTarget> ClothingPairs::find(const Vertices& surface, const ClothingTerms& terms,
                                               const Eigen::VectorXd& tightness) const {
  const Vertices normals = vertexNormals(model_.topology()->faces(), surface);
  const RobustLoss inside{RobustLoss::Kind::kGemanMcClure, terms.loss_scale};
  const RobustLoss outside{RobustLoss::Kind::kGemanMcClure, options_.outside_scale};
  std::vector<SurfaceTarget> targets;
  for (std::size_t i = 0; i < chosen_.size(); ++i) {
    const auto v = chosen_[i];
    const auto pair = pairOf(surface, normals, v);
    if (!pair) continue;
    const double square = pair->height * pair->height;
    const double tight = tightness.size() > 0 ? tightness[Eigen::Index(i)] : 1;
    const double weight = pair->height > 0 ? (terms.weights.data + terms.weights.cloth) * outside.weight(square)
                                           : terms.weights.data * tight * inside.weight(square);
    targets.push_back(
        {{v, v, v}, Eigen::Vector3d::UnitX(), pair->position.transpose(), pair->normal.transpose(), weight});
  }
  const auto pulls =
      landmarkTargets(landmarks_, model_.topology()->faces(), terms.weights.landmarks * double(targets.size()));
  targets.insert(targets.end(), pulls.begin(), pulls.end());
  return targets;
}

double ClothingPairs::misfit(const Vertices& surface) const {
  const Eigen::VectorXd below = gaps(surface);
  double body = 0, scan = 0;
  for (const double gap : below)
    body += std::isnan(gap) ? 1 : bounded(gap, gap >= 0 ? options_.outside_scale : options_.outside_scale / 3);
  Vertices points(Eigen::Index(chosen_.size()), 3);
  for (std::size_t i = 0; i < chosen_.size(); ++i) points.row(Eigen::Index(i)) = surface.row(chosen_[i]);
  const PointTree tree(points);
  const auto samples = everyFew(scan_.points(), scan_.normals(), kScanPoints);
  for (const auto& point : samples.points.rowwise())
    scan += bounded(std::sqrt(tree.nearest(point).squared_distance), options_.thickest);
  return body / double(below.size()) + scan / double(samples.points.rows());
}

void ClothingPairs::measure(const Vertices& surface, ClothedFrame& frame) const {
  const Vertices normals = vertexNormals(model_.topology()->faces(), surface);
  const double tolerance = 2 * options_.scan_noise;
  double pairs = 0, inside = 0, strictly = 0, gap = 0, explained = 0;
  for (std::int32_t v = 0; v < surface.rows(); ++v)
    if (const auto pair = pairOf(surface, normals, v)) {
      pairs += 1;
      inside += pair->height <= tolerance;
      strictly += pair->height <= 0;
      gap -= pair->height;
    }
  frame.seen = pairs / double(surface.rows());
  frame.inside = pairs > 0 ? inside / pairs : 0;
  frame.inside_strictly = pairs > 0 ? strictly / pairs : 0;
  frame.mean_gap = pairs > 0 ? gap / pairs : 0;
  const ClosestPointQuery closest(surface, model_.topology()->faces());
  for (const auto& point : scan_.points().rowwise()) explained += closest(point).distance <= options_.thickest;
  frame.explained = explained / double(scan_.points().rows());
}

}  // namespace shaped
