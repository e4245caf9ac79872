#include "core/reduction/ghost_space.h"

namespace shaped {

GhostSpace::GhostSpace(const TopologyPtr& topology, ShapeSubspace subspace, const std::vector<Vertices>& shapes,
                       std::int32_t vertices, const std::stop_token& stop)
    : GhostSpace(coarsen(topology, shapes, {vertices, {}, stop}), std::move(subspace)) {}

GhostSpace::GhostSpace(Coarsening ghost, ShapeSubspace subspace)
    : fine_(std::move(subspace)),
      coarsening_(std::move(ghost)),
      structure_(std::make_shared<const ShellStructure>(coarsening_.coarse)),
      origin_(restrict(fine_.origin)),
      basis_(origin_.size(), fine_.dimension()) {
  for (Eigen::Index j = 0; j < basis_.cols(); ++j) basis_.col(j) = restrict(Eigen::VectorXd(fine_.basis.col(j)));
}

bool GhostSpace::append(const Eigen::VectorXd& direction) {
  if (!fine_.append(direction)) return false;
  basis_.conservativeResize(Eigen::NoChange, basis_.cols() + 1);
  basis_.rightCols<1>() = restrict(Eigen::VectorXd(fine_.basis.rightCols<1>()));
  return true;
}

Eigen::VectorXd GhostSpace::restrict(const Eigen::VectorXd& vector) const {
  Eigen::VectorXd rows(3 * static_cast<Eigen::Index>(coarsening_.kept.size()));
  for (std::size_t i = 0; i < coarsening_.kept.size(); ++i)
    rows.segment<3>(3 * static_cast<Eigen::Index>(i)) = vector.segment<3>(3 * coarsening_.kept[i]);
  return rows;
}

}  // namespace shaped
