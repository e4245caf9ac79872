#include "core/model/shell_pga_tasks.h"

#include <cmath>
#include <set>

#include "core/editing/handle_edit.h"
#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/shell/energy.h"
#include "core/shell/shell_objective.h"

namespace shaped {
namespace {

SubmanifoldOptions submanifoldOptions(int modes, std::stop_token stop) {
  SubmanifoldOptions options;
  options.modes = modes;
  options.stop = std::move(stop);
  return options;
}

double areaRatio(const ShellPgaModel& model, const Vertices& shape) {
  return smallestAreaRatio(model.topology().faces(), model.mean(), shape);
}

std::vector<AnchorTarget> targetsOf(const ShellPgaModel& model, const std::vector<Handle>& handles) {
  std::set<std::int32_t> seen;
  std::vector<AnchorTarget> targets;
  for (std::size_t i = 0; i < handles.size(); ++i) {
    const std::string field = "handles[" + std::to_string(i) + "]";
    if (!handles[i].position.allFinite()) throw InvalidInput(field, "has a coordinate that is not a finite number");
    if (!seen.insert(handles[i].vertex).second)
      throw InvalidInput(field, "names vertex " + std::to_string(handles[i].vertex) + " a second time");
    targets.push_back({model.anchorOfVertex(handles[i].vertex, field), handles[i].position, 1});
  }
  return targets;
}

/// min over s of W[s, prior] at full resolution with the handle vertices where they are wanted.
Solved<Vertices> finishAtFullResolution(const ShellPgaModel& model, const std::vector<Handle>& handles,
                                        const Vertices& prior, Vertices start, std::stop_token stop) {
  const auto structure = model.fineStructure(stop);
  if (!structure) return {std::move(start), {Termination::kCancelled, 0, 0}};
  ShellObjective objective(structure, model.parts().bending);
  objective.addDeformed(measure(model.topology(), prior), 1);
  Pins pins(model.topology().vertexCount());
  for (const auto& handle : handles) {
    pins.pinAll(handle.vertex);
    start.row(handle.vertex) = handle.position;
  }
  objective.setPins(std::move(pins));
  return minimiseShell(objective, *structure, start, {60, 1e-6, std::move(stop)});
}

/// The shape of coefficients in the submanifold of the prolongated mean and variations. coarse_local: q(alpha) on the
/// coarse mesh, from which the solution starts.
Vertices solveAtFullResolution(const ShellPgaModel& model, const SubmanifoldPoint& coefficients,
                               const Vertices& coarse_local, const std::stop_token& stop, Outcome& outcome) {
  Vertices start = model.prolongate(coarse_local);
  const auto fine = model.fineSubmanifold(stop);
  if (!fine) {
    outcome.termination = Termination::kCancelled;
    return start;
  }
  auto solved = fine->shapeOf(coefficients, submanifoldOptions(0, stop), &start);
  outcome += solved;
  return std::move(solved.solution.shape);
}

/// Modes of less than this share of the largest variance, or of a negative one, carry no information about the training
/// shapes: the Gram matrix is exact to second order in 1/K only.
constexpr double kLeastVariance = 1e-6;

}  // namespace

void warm(const ShellPgaModel& model) {
  SubmanifoldPoint point;
  point.alpha = Eigen::VectorXd::Unit(2 * model.modes(), 0);
  synthesize(model, point, {});
}

ShellPgaScore scoreOf(const ShellPgaModel& model, const Eigen::VectorXd& tangent_coordinates) {
  constexpr double log_two_pi = 1.8378770664093453;
  const auto count = tangent_coordinates.size();
  const auto& variances = model.pga().eigenvalues;
  double squared = 0, constants = 0;
  for (Eigen::Index j = 0; j < count && variances[j] > kLeastVariance * variances[0]; ++j) {
    squared += tangent_coordinates[j] * tangent_coordinates[j] / variances[j];
    constants += std::log(variances[j]) + log_two_pi;
  }
  return {std::sqrt(squared), -0.5 * (squared + constants), 0};
}

Solved<ShellPgaProjection> project(const ShellPgaModel& model, const Vertices& shape,
                                   const ProjectionOptions& options) {
  const Vertices coarse = model.restrict(shape, "shape");
  auto solved = model.submanifold().project(coarse, submanifoldOptions(options.modes, options.stop));
  ShellPgaProjection result;
  const Vertices& projected = solved.solution.shape;
  result.coefficients = solved.solution.point;
  const int modes = options.modes == 0 ? model.modes() : options.modes;
  result.tangent_coordinates = model.submanifold().tangentCoordinates(result.coefficients).head(modes);
  result.residual_energy = shellEnergy(model.coarseCalculus().topology(), coarse, projected, model.parts().bending);
  result.score = scoreOf(model, result.tangent_coordinates);
  result.score.residual_distance = std::sqrt(std::max(result.residual_energy, 0.0));
  Outcome outcome = solved;
  const Vertices fine =
      options.fine ? solveAtFullResolution(model, result.coefficients, solved.solution.local, options.stop, outcome)
                   : model.prolongate(projected);
  result.shape = apply(alignRigidly(fine, shape), fine);
  result.smallest_area_ratio = areaRatio(model, result.shape);
  return {std::move(result), outcome};
}

Solved<SynthesizedShape> synthesize(const ShellPgaModel& model, const SubmanifoldPoint& coefficients,
                                    const SynthesisOptions& options) {
  const auto coarse = model.submanifold().shapeOf(coefficients, submanifoldOptions(0, options.stop));
  Outcome outcome = coarse;
  Vertices shape = options.fine
                       ? solveAtFullResolution(model, coefficients, coarse.solution.local, options.stop, outcome)
                       : model.prolongate(coarse.solution.shape);
  const double ratio = areaRatio(model, shape);
  return {{std::move(shape), ratio}, outcome};
}

Solved<ShellPgaEdit> edit(const ShellPgaModel& model, const std::vector<Handle>& handles, const EditOptions& options) {
  if (options.outer_iterations < 1)
    throw InvalidInput("outer_iterations", std::to_string(options.outer_iterations) + ", want >= 1");
  HandleEditOptions edit_options;
  edit_options.outer_iterations = options.outer_iterations;
  edit_options.submanifold.modes = options.modes;
  edit_options.submanifold.stop = options.stop;
  auto coarse = editByHandles(model.submanifold(), targetsOf(model, handles), edit_options);
  Outcome outcome = coarse;
  ShellPgaEdit result;
  result.energies = std::move(coarse.solution.energies);
  result.coefficients = coarse.solution.projection.point;
  result.projection = model.prolongate(coarse.solution.projection.shape);
  if (options.stop.stop_requested()) {
    result.shape = model.prolongate(coarse.solution.shape);
    outcome.termination = Termination::kCancelled;
    return {std::move(result), outcome};
  }
  const auto fine =
      finishAtFullResolution(model, handles, result.projection, model.prolongate(coarse.solution.shape), options.stop);
  outcome += fine;
  result.shape = fine.solution;
  for (const auto& handle : handles)
    result.largest_handle_distance = std::max(result.largest_handle_distance,
                                              (result.shape.row(handle.vertex).transpose() - handle.position).norm());
  result.smallest_area_ratio = areaRatio(model, result.shape);
  return {std::move(result), outcome};
}

}  // namespace shaped
