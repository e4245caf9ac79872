#pragma once

#include "core/registration/scan_to_model.h"

namespace shaped {

/// Closest points of a scan and a model's surface, both ways, as targets for fitBody.
class ModelPairs {
 public:
  /// All three must outlive it.
  ModelPairs(const ScanSurface& scan, const BodyModel& model, const ModelFitOptions& options);

  /// Pairs under the level's gates and loss; each side's weights sum to at most 1, less what the loss takes away.
  /// surface: V x 3, the model's present one.
  std::vector<SurfaceTarget> find(const Vertices& surface, const ModelFitLevel& level) const;

  ModelFitReport report(const Vertices& surface, const ModelFitLevel& level) const;

 private:
  void addFromModel(const Vertices& surface, const Vertices& normals, const ModelFitLevel& level,
                    std::vector<SurfaceTarget>& targets) const;
  void addFromScan(const Vertices& surface, const Vertices& normals, const ModelFitLevel& level,
                   std::vector<SurfaceTarget>& targets) const;
  /// Whether two normals of a pair are near enough; those of the scan may have no sign, or be unknown (zero).
  bool facing(const Eigen::RowVector3d& scan_normal, const Eigen::RowVector3d& model_normal) const;
  void reportModel(const Vertices& surface, const Vertices& normals, const ModelFitLevel& level,
                   ModelFitReport& report) const;
  void reportScan(const Vertices& surface, const Vertices& normals, const ModelFitLevel& level,
                  ModelFitReport& report) const;

  const ScanSurface& scan_;
  const BodyModel& model_;
  const ModelFitOptions& options_;
  double least_cosine_;
  std::vector<std::int32_t> region_;      ///< the joint that carries each vertex foremost
  std::vector<std::int32_t> scan_order_;  ///< the scan's points, shuffled: the first few are an even choice
};

}  // namespace shaped
