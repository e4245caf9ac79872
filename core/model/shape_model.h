#pragma once

#include <memory>
#include <stop_token>
#include <string>

#include "core/io/model_directory.h"
#include "core/markers/marker_set.h"
#include "core/mesh/topology.h"
#include "core/model/model_point.h"
#include "core/model/take_fitter.h"
#include "core/numerics/solved.h"

namespace shaped {

/// How probable a shape is under a model.
struct ShapeScore {
  double mahalanobis = 0;        ///< distance of the projection to the mean in units of the model's deviations
  double log_likelihood = 0;     ///< of the projection's tangent coordinates [m], natural logarithm of the density
  double residual_distance = 0;  ///< the part that the model does not explain [m]; how it is measured, its kind says
};

struct ProjectionOptions {
  int modes = 0;      ///< J to use, 0 = all of the model's
  bool fine = false;  ///< finish by Newton's method at full resolution, where the kind works on a coarse mesh
  std::stop_token stop;
};

/// The model's shape nearest to a given one.
struct ShapeProjection {
  Vertices shape;  ///< V x 3, placed as the given one
  ModelPoint point;
  Eigen::VectorXd tangent_coordinates;  ///< along the principal components [m]
  double residual_energy = 0;           ///< elastic, of what the model does not explain [m^2]; 0 where it has no energy
  ShapeScore score;
  double smallest_area_ratio = 1;  ///< over triangles: area in `shape` over area in the mean
};

struct SynthesisOptions {
  bool fine = false;  ///< finish by Newton's method at full resolution, where the kind works on a coarse mesh
  std::stop_token stop;
};

/// A full-resolution shape with a solver's quality.
struct SynthesizedShape {
  Vertices shape;
  double smallest_area_ratio = 1;
};

/// What every served model offers, whatever its kind. Immutable; safe to share between threads.
class ShapeModel {
 public:
  virtual ~ShapeModel() = default;

  /// As in its manifest: "shell_pga".
  virtual std::string kind() const = 0;
  virtual const TopologyPtr& topologyPtr() const = 0;
  const Topology& topology() const { return *topologyPtr(); }
  /// V x 3 [m].
  virtual const Vertices& mean() const = 0;
  /// J.
  virtual int modes() const = 0;
  /// Memory of the model once it is warm, about.
  virtual std::size_t bytes() const = 0;

  /// Computes one shape, so that the first request does not wait for memory and caches.
  virtual void warm() const = 0;
  /// Coefficients of a shape, V x 3, and what the model's prior says of them. Throws InvalidInput naming "shape" or
  /// "modes".
  virtual Solved<ShapeProjection> project(const Vertices& shape, const ProjectionOptions& options) const = 0;
  /// The shape of coefficients. Throws InvalidInput naming the part of the point that is none of this model.
  virtual Solved<SynthesizedShape> synthesize(const ModelPoint& point, const SynthesisOptions& options) const = 0;
  /// Fits takes of markers. The fitter holds the model. Throws InvalidInput when a marker does not fit the topology,
  /// there are fewer than three, or an option is out of range.
  virtual std::unique_ptr<TakeFitter> takeFitter(const MarkerSet& markers, const TakeOptions& options) const = 0;

  /// Writes the model as a new version and returns its number. provenance: an object for whoever keeps the store.
  /// Throws as ModelDirectory::publish.
  virtual std::int64_t publish(const ModelDirectory& directory, const std::string& name,
                               const nlohmann::json& provenance) const = 0;
};

using ShapeModelPtr = std::shared_ptr<const ShapeModel>;

}  // namespace shaped
