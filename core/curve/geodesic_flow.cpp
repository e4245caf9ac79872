#include "core/curve/geodesic_flow.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/curve/flow_tangents.h"
#include "core/curve/reduced_solver.h"
#include "core/geodesic/length_angle.h"
#include "core/mesh/alignment.h"
#include "core/numerics/error.h"
#include "core/reduction/krylov.h"

namespace shaped {
namespace {

/// What carries an aligned shape on its way from a's position to b's.
class Travel {
 public:
  /// motion: from a's position to b's. Turns about the centre of a.
  Travel(const RigidMotion& motion, const Vertices& a)
      : turn_(motion.rotation), centre_(a.colwise().mean().transpose()) {
    shift_ = motion.rotation * centre_ + motion.translation - centre_;
  }

  Vertices operator()(const Vertices& shape, double share) const {
    const Eigen::Matrix3d rotation = Eigen::Quaterniond::Identity().slerp(share, turn_).toRotationMatrix();
    return apply(RigidMotion{rotation, centre_ + share * shift_ - rotation * centre_}, shape);
  }

 private:
  Eigen::Quaterniond turn_;
  Eigen::Vector3d centre_, shift_;
};

constexpr std::size_t kRough = 5;  ///< frames of a geodesic whose tangents enrich the subspace

/// Shapes whose lengths and angles are blends of the ends', between them. Empty when one cannot be built.
std::vector<Vertices> blends(const TopologyPtr& topology, const Vertices& a, const Vertices& b,
                             const std::stop_token& stop) {
  const LengthAngleReconstruction reconstruction(topology);
  const auto from = measure(*topology, a), to = measure(*topology, b);
  std::vector<Vertices> shapes;
  for (std::size_t k = 1; k + 1 < kRough; ++k) {
    const double share = static_cast<double>(k) / static_cast<double>(kRough - 1);
    auto shape = reconstruction.reconstruct(blendMeasures(from, to, share), shapes.empty() ? a : shapes.back(), stop);
    if (shape.rows() == 0) return {};
    shapes.push_back(apply(alignRigidly(shape, a), shape));
  }
  return shapes;
}

class Refinement {
 public:
  Refinement(const ShellStructurePtr& structure, GhostSpace& space, double bending, const GeodesicFlowOptions& options)
      : structure_(structure), space_(space), bending_(bending), options_(options) {}

  /// Coordinates of a geodesic with as many frames as wanted, between the ends of a rough path with no more.
  Solved<std::vector<Eigen::VectorXd>> run(std::vector<Eigen::VectorXd> rough, const ProgressSink& progress) {
    Solved<std::vector<Eigen::VectorXd>> result(std::move(rough), {});
    auto& path = result.solution;
    const auto wanted = static_cast<std::size_t>(options_.frames);
    if (path.size() > 2) settle(path, result);
    while (path.size() < wanted && result.termination != Termination::kCancelled) {
      const auto segments = (path.size() - 1) * static_cast<std::size_t>(options_.insert + 1);
      path = refined(path, std::min(segments, wanted - 1) + 1);
      settle(path, result);
      if (progress)
        progress({std::to_string(path.size()) + " frames",
                  static_cast<double>(path.size()) / static_cast<double>(wanted), result.residual});
    }
    return result;
  }
  double pathEnergy() const { return path_energy_; }
  double fullResidual() const { return full_residual_; }

 private:
  void settle(std::vector<Eigen::VectorXd>& path, Outcome& outcome) {
    outcome += flow(path);
    if (path.size() >= std::min(kRough, static_cast<std::size_t>(options_.frames))) enrich(path, outcome);
  }

  /// Adds the flow tangents of the path and lets it flow again, as often as is left to do.
  void enrich(std::vector<Eigen::VectorXd>& path, Outcome& outcome) {
    for (; enrichments_ < options_.enrichments && path.size() > 2; ++enrichments_) {
      if (outcome.termination == Termination::kCancelled) return;
      Curve curve{{}, false};
      for (const auto& coordinates : path) curve.frames.push_back(space_.fine().shape(coordinates));
      const auto tangents = flowTangents(structure_, bending_, curve, options_.stop);
      full_residual_ = tangents.residual;
      bool more = false;
      for (const auto& direction : tangents.directions)
        if (direction.size() > 0) more = space_.append(direction) || more;
      if (!more) return;
      for (auto& coordinates : path) {
        const auto before = coordinates.size();
        coordinates.conservativeResize(space_.dimension());
        coordinates.tail(space_.dimension() - before).setZero();
      }
      outcome += flow(path);
    }
  }

  /// Frames at even steps along the old ones: averages of the two around each.
  std::vector<Eigen::VectorXd> refined(const std::vector<Eigen::VectorXd>& old, std::size_t frames) const {
    std::vector<Eigen::VectorXd> path(frames);
    std::vector<ShellMeasures> measures;
    for (const auto& coordinates : old)
      measures.push_back(measure(*space_.topology(), FrameSpace{&space_}.ghost(coordinates)));
    tbb::parallel_for(std::size_t{0}, frames, [&](std::size_t i) {
      const double position =
          static_cast<double>(i) * static_cast<double>(old.size() - 1) / static_cast<double>(frames - 1);
      const auto below = std::min(static_cast<std::size_t>(position), old.size() - 2);
      const double share = position - static_cast<double>(below);
      path[i] = (1 - share) * old[below] + share * old[below + 1];
      if (share < 1e-9 || share > 1 - 1e-9 || options_.stop.stop_requested()) return;
      ReducedSolver solver(FrameSpace{&space_}, {bending_, options_.symmetry}, options_.tolerance, options_.stop);
      const auto solved = solver.average({{&measures[below], 1 - share}, {&measures[below + 1], share}}, path[i]);
      if (solved.converged()) path[i] = solved.solution;
    });
    return path;
  }

  Outcome flow(std::vector<Eigen::VectorXd>& path) {
    Curve curve{{}, false};
    std::vector<ReducedSolver> solvers;
    for (const auto& coordinates : path) {
      curve.frames.push_back(FrameSpace{&space_}.ghost(coordinates));
      solvers.emplace_back(FrameSpace{&space_}, PairEnergy(bending_, options_.symmetry), options_.tolerance,
                           options_.stop);
    }
    const auto average = [&](std::size_t i, const std::vector<AverageTerm>& terms, const FlowFrame& now) {
      auto solved = solvers[i].average(terms, now.coordinates);
      return Solved<FlowFrame>({solvers[i].space().ghost(solved.solution), solved.solution}, solved);
    };
    SmoothingFlow flow(space_.topology(), bending_, curve, path, average,
                       {.tau = 1, .place = false, .stop = options_.stop});
    Outcome outcome{Termination::kIterationLimit, 0, 0};
    for (int k = 0; k < options_.steps; ++k) {
      const auto step = flow.step();
      outcome.iterations += step.iterations;
      outcome.residual = step.residual;
      if (step.converged()) continue;
      outcome.termination = step.solution.stationary ? Termination::kConverged : step.termination;
      break;
    }
    for (std::size_t i = 0; i < path.size(); ++i) path[i] = flow.frame(i).coordinates;
    path_energy_ = flow.pathEnergy();
    return outcome;
  }

  const ShellStructurePtr& structure_;
  GhostSpace& space_;
  double bending_;
  const GeodesicFlowOptions& options_;
  int enrichments_ = 0;
  double path_energy_ = 0, full_residual_ = 0;
};

}  // namespace

std::optional<std::string> GeodesicFlowOptions::firstViolation() const {
  const auto whole = [](const char* name, std::int64_t value, int least) {
    return std::string(name) + " = " + std::to_string(value) + ", want >= " + std::to_string(least);
  };
  if (frames < 2) return whole("frames", frames, 2);
  if (insert < 1) return whole("insert", insert, 1);
  if (dimension < 1) return whole("dimension", dimension, 1);
  if (ghost_vertices < 4) return whole("ghost_vertices", ghost_vertices, 4);
  if (enrichments < 0) return whole("enrichments", enrichments, 0);
  if (steps < 1) return whole("steps", steps, 1);
  if (!(tolerance > 0)) return "tolerance = " + std::to_string(tolerance) + ", want > 0";
  return std::nullopt;
}

Solved<GeodesicFlow> geodesicByFlow(const ShellStructurePtr& structure, double bending, const Vertices& a,
                                    const Vertices& b, const GeodesicFlowOptions& options,
                                    const ProgressSink& progress) {
  if (const auto violation = options.firstViolation()) throw InvalidInput("options", *violation);
  requireOneComponent(structure->topology(), "topology");
  requireValidShape(structure->topology(), a, "a");
  requireValidShape(structure->topology(), b, "b");
  const auto onto_a = alignRigidly(b, a);
  const Vertices aligned = apply(onto_a, b);
  Solved<GeodesicFlow> result({Curve{{a, b}, false}, 0, 0, 0}, {});
  auto subspace = krylovSubspace(structure, bending, a, aligned, options.dimension, options.stop);
  if (!subspace.converged()) return {std::move(result.solution), subspace};
  std::vector<Vertices> rough{a, aligned};
  if (static_cast<std::size_t>(options.frames) >= kRough) {
    const auto between = blends(structure->topologyPtr(), a, aligned, options.stop);
    rough.insert(rough.begin() + 1, between.begin(), between.end());
    for (const auto& shape : between)
      subspace.solution.append(Eigen::Map<const Eigen::VectorXd>(shape.data(), shape.size()) -
                               Eigen::Map<const Eigen::VectorXd>(a.data(), a.size()));
  }
  std::vector<Eigen::VectorXd> start;
  for (const auto& shape : rough) start.push_back(subspace.solution.coordinates(shape));
  GhostSpace space(structure->topologyPtr(), std::move(subspace.solution), rough, options.ghost_vertices, options.stop);
  Refinement refinement(structure, space, bending, options);
  const auto path = refinement.run(std::move(start), progress);
  if (path.termination == Termination::kCancelled) return {std::move(result.solution), path};

  const Travel travel(inverse(onto_a), a);
  auto& frames = result.solution.curve.frames;
  frames.assign(path.solution.size(), a);
  frames.back() = b;
  tbb::parallel_for(std::size_t{1}, frames.size() - 1, [&](std::size_t i) {
    frames[i] =
        travel(space.fine().shape(path.solution[i]), static_cast<double>(i) / static_cast<double>(frames.size() - 1));
  });
  result.solution.path_energy = refinement.pathEnergy();
  result.solution.dimension = space.dimension();
  result.solution.full_residual = refinement.fullResidual();
  return {std::move(result.solution), path};
}

}  // namespace shaped
