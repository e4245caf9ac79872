#pragma once

#include <vector>

#include "core/mesh/alignment.h"
#include "core/registration/surface_samples.h"
#include "core/surface/point_tree.h"

namespace shaped {

/// One side of an alignment: a dense sample to search in, a sparse one that searches.
class SampledSurface {
 public:
  SampledSurface(SurfaceSamples dense, SurfaceSamples sparse)
      : dense_(std::move(dense)), sparse_(std::move(sparse)), tree_(dense_.points) {}

  const SurfaceSamples& dense() const { return dense_; }
  const SurfaceSamples& sparse() const { return sparse_; }
  const PointTree& tree() const { return tree_; }

 private:
  SurfaceSamples dense_, sparse_;
  PointTree tree_;
};

/// How far a pair counts.
struct IcpOptions {
  double scan_share;      ///< share of the scan's points that have a partner
  double template_share;  ///< share of the template's points that have one
  double largest_scale;   ///< scale within [1 / largest_scale, largest_scale]
  bool oriented;          ///< the scan's normals have a sign
};

/// Pairs of template and scan points under one placement.
struct IcpPairs {
  Vertices model, normals, scan;  ///< n x 3: template point and normal (in the template's frame), scan point
  Eigen::VectorXd weights;        ///< n, >= 0
  double score;                   ///< trimmed root mean square distance of both sides, m
  double overlap;                 ///< share of the template's points about as near to the scan as it is to them
};

/// Trimmed, robust closest points both ways between a template and a scan.
class Icp {
 public:
  /// Both must outlive it.
  Icp(const SampledSurface& model, const SampledSurface& scan, const IcpOptions& options)
      : model_(model), scan_(scan), options_(options) {}

  IcpPairs pair(const SimilarityMotion& placement) const;
  /// One step to the closed-form minimum of point-to-point distances.
  SimilarityMotion stepToPoints(const IcpPairs& pairs) const;
  /// One Gauss-Newton step of distances to the template's tangent planes.
  SimilarityMotion stepToPlanes(const IcpPairs& pairs, const SimilarityMotion& placement) const;

 private:
  double appendScanPairs(const SimilarityMotion& placement, IcpPairs& pairs, Eigen::Index first) const;
  void appendModelPairs(const SimilarityMotion& placement, IcpPairs& pairs, Eigen::Index first,
                        Eigen::VectorXd& squares) const;
  double clampScale(double scale) const;
  double normalWeight(const Eigen::RowVector3d& one, const Eigen::RowVector3d& other) const;

  const SampledSurface& model_;
  const SampledSurface& scan_;
  IcpOptions options_;
};

}  // namespace shaped
