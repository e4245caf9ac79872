#pragma once

#include <vector>

#include "core/clothing/under_clothing.h"
#include "core/surface/point_tree.h"

namespace shaped {

/// What a step of the schedule asks of the pairs.
struct ClothingTerms {
  ClothingWeights weights;
  double loss_scale;  ///< of the robust loss of points inside, m
};

/// The scan of one frame as targets for a body inside it.
class ClothingPairs {
 public:
  /// All must outlive it.
  ClothingPairs(const ScanSurface& scan, const BodyModel& model, const std::vector<Landmark>& landmarks,
                const ClothingOptions& options);

  /// The model's vertices that take part, spread evenly by area; the same for every frame of a model.
  const std::vector<std::int32_t>& vertices() const { return chosen_; }

  /// How far each of those lies below the scan (above: negative), m; NaN without a scan point nearby that faces its
  /// way. surface: V x 3.
  Eigen::VectorXd gaps(const Vertices& surface) const;

  /// Closest scan points of the vertices that take part: inside with the data's weight times the vertex's `tightness`
  /// (one a vertex of vertices(); empty: 1) under the robust loss, outside with the data's and the cloth's; then the
  /// landmarks.
  std::vector<SurfaceTarget> find(const Vertices& surface, const ClothingTerms& terms,
                                  const Eigen::VectorXd& tightness) const;

  /// How badly the body lies in the scan: robust mean cost of its vertices, those outside counting most, and that of
  /// the scan's points that are far from the body; 0 to 2.
  double misfit(const Vertices& surface) const;

  /// Fills all that ClothedFrame says of the surface.
  void measure(const Vertices& surface, ClothedFrame& frame) const;

 private:
  struct Pair {
    Eigen::RowVector3d position, normal;  ///< outward as the body's own normal says where the scan's has no sign
    double height;                        ///< of the vertex above the scan, m
  };
  std::optional<Pair> pairOf(const Vertices& surface, const Vertices& normals, std::int32_t vertex) const;

  const ScanSurface& scan_;
  const BodyModel& model_;
  const std::vector<Landmark>& landmarks_;
  const ClothingOptions& options_;
  std::vector<std::int32_t> chosen_;
};

}  // namespace shaped
