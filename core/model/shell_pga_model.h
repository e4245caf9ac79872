#pragma once

#include <memory>
#include <optional>
#include <stop_token>

#include "core/markers/marker_set.h"
#include "core/mesh/anchor.h"
#include "core/mesh/prolongation.h"
#include "core/mocap/marker_tracker.h"
#include "core/numerics/made_once.h"
#include "core/statistics/submanifold.h"

namespace shaped {

/// How a model was trained.
struct TrainingRecord {
  int shapes = 0;      ///< n
  Outcome mean;        ///< how the Frechet mean ended
  Outcome variations;  ///< how the principal variations ended
  double seconds = 0;  ///< set by whoever measured; 0 where nobody did

  Outcome combined() const { return Outcome(mean) += variations; }
};

/// All that a Shell PGA model is made of; what its file holds.
struct ShellPgaParts {
  TopologyPtr topology;                                  ///< of full-resolution shapes
  Coarsening coarsening;                                 ///< the mesh that statistics and solvers work on
  Vertices template_shape;                               ///< full resolution; marker offsets are given in its axes
  Vertices reference;                                    ///< full resolution; prolongation carries its detail
  SparseRows detail;                                     ///< learned correction of the prolongation, V x 2C
  double bending = 0;                                    ///< eta [m^2]
  EnergySymmetry symmetry = EnergySymmetry::kSymmetric;  ///< of the squared distance in paths, mean and Gram matrix
  ShellPga pga;                                          ///< on the coarse mesh
  TrainingRecord training;
};

/// Shell PGA of shapes with one connectivity: mean, variances and principal variations of [HZRS18] on a coarse mesh,
/// and what carries coarse shapes to full resolution. Immutable after construction; safe to share between threads.
class ShellPgaModel {
 public:
  explicit ShellPgaModel(ShellPgaParts parts);
  /// From parts of which there are a calculus on the coarse mesh and a prolongation already: nothing is factorised.
  ShellPgaModel(ShellPgaParts parts, std::shared_ptr<const GeodesicCalculus> calculus,
                std::shared_ptr<const Prolongation> prolongation);

  /// The same model with another record of its training.
  std::shared_ptr<const ShellPgaModel> withRecord(const TrainingRecord& record) const;

  const Topology& topology() const { return *parts_->topology; }
  const TopologyPtr& topologyPtr() const { return parts_->topology; }
  const ShellPgaParts& parts() const { return *parts_; }
  const ShellPga& pga() const { return submanifold_->pga(); }
  const Submanifold& submanifold() const { return *submanifold_; }
  const std::shared_ptr<const Submanifold>& submanifoldPtr() const { return submanifold_; }
  const GeodesicCalculus& coarseCalculus() const { return submanifold_->calculus(); }
  int modes() const { return pga().modes(); }
  /// Full-resolution Frechet mean, V x 3.
  const Vertices& mean() const { return mean_; }
  /// Memory of the arrays and of the prolongation's factor [bytes], once every mode has been used: a mapped file counts
  /// as a whole. Without what fine requests add.
  std::size_t bytes() const;

  /// The coarse rows of a full-resolution shape. Throws InvalidInput naming `field` when the shape does not fit.
  Vertices restrict(const Vertices& shape, const std::string& field) const;
  /// A coarse shape at full resolution.
  Vertices prolongate(const Vertices& coarse) const { return prolongation_->prolongate(coarse); }

  /// Where a full-resolution vertex sits on the coarse mesh. Throws InvalidInput naming `field` when out of range.
  Anchor anchorOfVertex(std::int32_t vertex, const std::string& field) const;
  /// Where the markers sit on the coarse mesh. Throws InvalidInput naming markers[i].
  std::vector<MarkerSite> sitesOf(const MarkerSet& markers) const;

  /// Sparsity and symbolic factorisation at full resolution, made at the first call. Null once the stop token has
  /// fired.
  ShellStructurePtr fineStructure(const std::stop_token& stop = {}) const;
  /// The submanifold of the prolongated mean and variations at full resolution, made at the first call. Its pga() has
  /// the coarse variations; it may outlive the model. Null once the stop token has fired.
  std::shared_ptr<const Submanifold> fineSubmanifold(const std::stop_token& stop = {}) const;

 private:
  ShellPgaModel(std::shared_ptr<const ShellPgaParts> parts, std::shared_ptr<const GeodesicCalculus> calculus,
                std::shared_ptr<const Prolongation> prolongation);
  std::shared_ptr<const Submanifold> makeFineSubmanifold(const std::stop_token& stop) const;
  Anchor anchorOfPoint(const Eigen::Vector3d& point) const;
  MarkerSite siteAt(const Anchor& anchor, const Eigen::Vector3d& marker) const;

  std::shared_ptr<const ShellPgaParts> parts_;  ///< shared with the submanifold
  std::shared_ptr<const Submanifold> submanifold_;
  std::shared_ptr<const Prolongation> prolongation_;  ///< shared with the fine submanifold
  Vertices mean_;
  Vertices coarse_reference_, coarse_template_;
  MadeOnce<ShellStructure> fine_structure_;
  MadeOnce<Submanifold> fine_submanifold_;
};

using ShellPgaModelPtr = std::shared_ptr<const ShellPgaModel>;

}  // namespace shaped
