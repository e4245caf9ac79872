#include "core/clothing/clothing_pairs.h"

#include <cmath>
#include <numbers>

#include "core/mesh/quality.h"
#include "core/registration/landmark_targets.h"
#include "core/registration/surface_samples.h"

namespace shaped {

ClothingPairs::ClothingPairs(const Scan& scan, const BodyModel& model, const std::vector<Landmark>& landmarks,
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

std::vector<SurfaceTarget> ClothingPairs::find(const Vertices& surface, const ClothingWeights& weights) const {
  const Vertices normals = vertexNormals(model_.topology()->faces(), surface);
  const RobustLoss inside{RobustLoss::Kind::kGemanMcClure, options_.loss_scale};
  const RobustLoss outside{RobustLoss::Kind::kGemanMcClure, options_.outside_scale};
  std::vector<SurfaceTarget> targets;
  for (const std::int32_t v : chosen_) {
    const auto pair = pairOf(surface, normals, v);
    if (!pair) continue;
    const double square = pair->height * pair->height;
    const double weight = pair->height > 0 ? (weights.data + weights.cloth) * outside.weight(square)
                                           : weights.data * inside.weight(square);
    targets.push_back(
        {{v, v, v}, Eigen::Vector3d::UnitX(), pair->position.transpose(), pair->normal.transpose(), weight});
  }
  const auto pulls =
      landmarkTargets(landmarks_, model_.topology()->faces(), weights.landmarks * double(targets.size()));
  targets.insert(targets.end(), pulls.begin(), pulls.end());
  return targets;
}

void ClothingPairs::measure(const Vertices& surface, ClothedFrame& frame) const {
  const Vertices normals = vertexNormals(model_.topology()->faces(), surface);
  double pairs = 0, inside = 0, gap = 0;
  for (std::int32_t v = 0; v < surface.rows(); ++v)
    if (const auto pair = pairOf(surface, normals, v)) {
      pairs += 1;
      inside += pair->height <= 0;
      gap -= pair->height;
    }
  frame.inside = pairs > 0 ? inside / pairs : 0;
  frame.mean_gap = pairs > 0 ? gap / pairs : 0;
}

}  // namespace shaped
