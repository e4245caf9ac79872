#include "core/editing/handle_edit.h"

#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/shell/energy.h"

namespace shaped {
namespace {

Vertices wantedPositions(const std::vector<AnchorTarget>& handles) {
  Vertices wanted(static_cast<Eigen::Index>(handles.size()), 3);
  for (std::size_t l = 0; l < handles.size(); ++l) wanted.row(static_cast<Eigen::Index>(l)) = handles[l].position;
  return wanted;
}

class HandleEditor {
 public:
  HandleEditor(const Submanifold& submanifold, const std::vector<AnchorTarget>& handles, const HandleEditOptions& options)
      : submanifold_(submanifold), calculus_(submanifold.calculus()), handles_(handles), options_(options),
        wanted_(wantedPositions(handles)), size_(boundingBoxDiagonal(submanifold.pga().mean)) {}

  Solved<HandleEdit> run();

 private:
  void start();
  Outcome approach();
  Outcome meetHandles();
  bool improveProjection(Outcome& outcome);
  double handleDistance() const {
    return (anchorPositions(calculus_.topology(), handles_, edit_.shape) - wanted_).rowwise().norm().maxCoeff();
  }
  double energy(const Vertices& projection) const {
    return shellEnergy(calculus_.topology(), edit_.shape, projection, calculus_.bending());
  }

  const Submanifold& submanifold_;
  const GeodesicCalculus& calculus_;
  std::vector<AnchorTarget> handles_;
  const HandleEditOptions& options_;
  Vertices wanted_;
  double size_;
  HandleEdit edit_;
  Vertices prior_;
};

/// The mean, placed by its handle points.
void HandleEditor::start() {
  for (auto& handle : handles_) handle.weight = 1;
  const Vertices& mean = submanifold_.pga().mean;
  edit_.shape = apply(alignRigidly(anchorPositions(calculus_.topology(), handles_, mean), wanted_), mean);
  prior_ = edit_.shape;
}

/// Soft handles with growing weights, the projection following: from the mean to the neighbourhood of the solution.
Outcome HandleEditor::approach() {
  Outcome outcome;
  for (const double weight : {0.03, 0.3}) {
    for (auto& handle : handles_) handle.weight = weight;
    auto fit = fitAnchored(calculus_, prior_, handles_, edit_.shape, {1, 60, 1e-4, options_.submanifold.stop});
    edit_.shape = std::move(fit.solution);
    auto projected = submanifold_.project(edit_.shape, options_.submanifold,
                                          edit_.projection.geodesic.empty() ? nullptr : &edit_.projection);
    outcome.iterations += fit.iterations + projected.iterations;
    if (!projected.converged()) break;
    edit_.projection = std::move(projected.solution);
    prior_ = edit_.projection.shape;
  }
  return outcome;
}

/// min over s of W[s, prior] with the handles met: shifting the targets by the accumulated misses is the augmented
/// Lagrangian's multiplier update.
Outcome HandleEditor::meetHandles() {
  Outcome outcome;
  auto shifted = handles_;
  for (auto& handle : shifted) handle.weight = 100;
  for (int round = 0; round < 30; ++round) {
    auto fit = fitAnchored(calculus_, prior_, shifted, edit_.shape, {1, 60, 1e-9, options_.submanifold.stop});
    edit_.shape = std::move(fit.solution);
    outcome.iterations += fit.iterations;
    outcome.residual = handleDistance() / size_;
    outcome.termination = fit.termination;
    if (outcome.residual <= options_.handle_tolerance || fit.termination == Termination::kCancelled) break;
    const Vertices miss = anchorPositions(calculus_.topology(), handles_, edit_.shape) - wanted_;
    for (std::size_t l = 0; l < shifted.size(); ++l)
      shifted[l].position -= miss.row(static_cast<Eigen::Index>(l)).transpose();
    outcome.termination = Termination::kIterationLimit;
  }
  return outcome;
}

/// Takes P[s] when it lowers the energy.
bool HandleEditor::improveProjection(Outcome& outcome) {
  auto projected = submanifold_.project(edit_.shape, options_.submanifold,
                                        edit_.projection.geodesic.empty() ? nullptr : &edit_.projection);
  outcome.iterations += projected.iterations;
  if (!projected.converged()) {
    outcome.termination = projected.termination;
    return false;
  }
  if (!edit_.projection.geodesic.empty() && energy(projected.solution.shape) >= energy(prior_)) return false;
  edit_.projection = std::move(projected.solution);
  prior_ = edit_.projection.shape;
  return true;
}

Solved<HandleEdit> HandleEditor::run() {
  start();
  Outcome outcome = approach();
  for (int outer = 0;; ++outer) {
    const auto met = meetHandles();
    outcome.iterations += met.iterations;
    outcome.termination = met.termination;
    edit_.largest_handle_distance = handleDistance();
    if (!met.converged()) break;
    const bool moved = improveProjection(outcome);
    edit_.energies.push_back(energy(prior_));
    const auto count = edit_.energies.size();
    outcome.residual = count > 1 ? 1 - edit_.energies[count - 1] / edit_.energies[count - 2] : 1.0;
    if (!outcome.converged()) break;
    if (!moved || outcome.residual <= options_.tolerance) break;
    if (outer + 1 >= options_.outer_iterations) {
      outcome.termination = Termination::kIterationLimit;
      break;
    }
  }
  edit_.projection.shape = apply(alignRigidly(edit_.projection.shape, edit_.shape), edit_.projection.shape);
  return {std::move(edit_), outcome};
}

}  // namespace

Solved<HandleEdit> editByHandles(const Submanifold& submanifold, const std::vector<AnchorTarget>& handles,
                                 const HandleEditOptions& options) {
  auto weighted = handles;
  for (auto& handle : weighted) handle.weight = 1;
  if (!determinePlacement(weighted))
    throw InvalidInput("handles", "are fewer than three or lie on one line; they must determine where the shape stands");
  return HandleEditor(submanifold, handles, options).run();
}

}  // namespace shaped
