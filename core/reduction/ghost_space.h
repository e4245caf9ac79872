#pragma once

#include "core/mesh/coarsening.h"
#include "core/reduction/subspace.h"
#include "core/shell/structure.h"

namespace shaped {

/// A subspace of shapes and its image on a coarse "ghost" mesh that keeps some of the vertices, and with them rows of
/// the origin and the directions. Energies of the ghost stand for those of the shape ([BvTH16] section 6 after
/// [HSvTP11]), so what a reduced computation costs does not depend on the number of vertices.
class GhostSpace {
 public:
  /// shapes: for which the ghost mesh is made, all V x 3. vertices: of the ghost mesh, >= 4; a mesh with no more is its
  /// own ghost. Throws as coarsen().
  GhostSpace(const TopologyPtr& topology, ShapeSubspace subspace, const std::vector<Vertices>& shapes,
             std::int32_t vertices, const std::stop_token& stop = {});
  /// On a ghost mesh that is there already.
  GhostSpace(Coarsening ghost, ShapeSubspace subspace);

  const ShapeSubspace& fine() const { return fine_; }
  Eigen::Index dimension() const { return fine_.dimension(); }
  const ShellStructure& structure() const { return *structure_; }  ///< of the ghost mesh, G vertices
  const TopologyPtr& topology() const { return structure_->topologyPtr(); }
  const Vertices& origin() const { return origin_; }       ///< G x 3
  const Eigen::MatrixXd& basis() const { return basis_; }  ///< 3G x d, the columns not orthonormal

  Vertices restrict(const Vertices& shape) const { return restrictTo(coarsening_, shape); }
  /// Adds a direction, 3V, as ShapeSubspace::append.
  bool append(const Eigen::VectorXd& direction);
  /// The rows of a 3V vector that belong to the ghost's vertices.
  Eigen::VectorXd restrict(const Eigen::VectorXd& vector) const;

 private:
  ShapeSubspace fine_;
  Coarsening coarsening_;
  ShellStructurePtr structure_;
  Vertices origin_;
  Eigen::MatrixXd basis_;
};

}  // namespace shaped
