#pragma once

#include "core/clothing/under_clothing.h"

namespace shaped {

/// The scan of one frame as targets for a body inside it.
class ClothingPairs {
 public:
  /// model, landmarks and options must outlive it.
  ClothingPairs(const Scan& scan, const BodyModel& model, const std::vector<Landmark>& landmarks,
                const ClothingOptions& options);

  /// Closest scan points of some of the body's vertices (surface: V x 3): inside with the data's weight under the
  /// robust loss, outside with the cloth's beside it; then the landmarks.
  std::vector<SurfaceTarget> find(const Vertices& surface, const ClothingWeights& weights) const;

  /// Fills `inside` and `mean_gap`.
  void measure(const Vertices& surface, ClothedFrame& frame) const;

 private:
  struct Pair {
    Eigen::RowVector3d position, normal;  ///< outward as the body's own normal says where the scan's has no sign
    double height;                        ///< of the vertex above the scan, m
  };
  std::optional<Pair> pairOf(const Vertices& surface, const Vertices& normals, std::int32_t vertex) const;

  ScanSurface scan_;
  const BodyModel& model_;
  const std::vector<Landmark>& landmarks_;
  const ClothingOptions& options_;
  std::vector<std::int32_t> chosen_;  ///< vertices that take part, even by area
};

}  // namespace shaped
