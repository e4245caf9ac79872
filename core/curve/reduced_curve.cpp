#include "core/curve/reduced_curve.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "core/curve/flow_tangents.h"
#include "core/mesh/alignment.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

constexpr std::size_t kCoarse = 20;      ///< frames: curves with fewer bring their flow tangents along
constexpr std::size_t kGhostShapes = 8;  ///< that the ghost mesh is made for, spread over the curve

std::vector<Vertices> ghostShapes(const Curve& curve, std::size_t central) {
  std::vector<Vertices> shapes{curve.frames[central]};
  const std::size_t count = std::min(kGhostShapes, curve.size());
  for (std::size_t k = 0; k < count; ++k)
    if (const auto i = k * (curve.size() - 1) / std::max<std::size_t>(count - 1, 1); i != central)
      shapes.push_back(curve.frames[i]);
  return shapes;
}

}  // namespace

ReducedCurve::ReducedCurve(const TopologyPtr& topology, double bending, const Curve& curve,
                           const ReducedCurveOptions& options)
    : bending_(bending), options_(options), frames_(curve.size()) {
  requireOneComponent(*topology, "topology");
  requireCurve(*topology, curve, "frames");
  if (options.dimension < 1)
    throw InvalidInput("options", "dimension = " + std::to_string(options.dimension) + ", want >= 1");
  stiffness_ = pullStiffness(*topology, curve.frames.front(), 1);
  const auto central = centralShape(curve.frames);
  std::vector<Vertices> aligned(curve.size());
  tbb::parallel_for(std::size_t{0}, curve.size(), [&](std::size_t i) {
    aligned[i] = apply(alignRigidly(curve.frames[i], curve.frames[central]), curve.frames[i]);
  });
  auto subspace = principalSubspace(curve.frames[central], aligned, options.dimension);
  if (curve.size() < kCoarse) {
    // So few frames span too little of where they would go.
    const auto structure = std::make_shared<const ShellStructure>(topology);
    const auto tangents = flowTangents(structure, bending, {{aligned, curve.closed}}, options.stop);
    for (const auto& direction : tangents.front().directions)
      if (direction.size() > 0) subspace.append(direction);
  }
  space_ = std::make_unique<const GhostSpace>(topology, std::move(subspace), ghostShapes(curve, central),
                                              options.ghost_vertices, options.stop);
  tbb::parallel_for(std::size_t{0}, curve.size(), [&](std::size_t i) { frames_[i] = frameOf(aligned[i]); });
  beginning_.closed = curve.closed;
  for (const auto& frame : curve.frames) beginning_.frames.push_back(space_->restrict(frame));
}

ReducedCurve::Frame ReducedCurve::frameOf(const Vertices& aligned) const {
  const auto& shared = space_->fine();
  const auto own = including(shared, aligned);
  Frame frame{{space_.get()}, {}, own.coordinates(aligned)};
  if (own.dimension() == shared.dimension()) return frame;
  frame.missing = own.basis.rightCols<1>();
  frame.space.own = space_->restrict(frame.missing);
  return frame;
}

SmoothingFlow ReducedCurve::flow(const SmoothingFlowOptions& options) const {
  std::vector<Eigen::VectorXd> coordinates;
  const auto solvers = std::make_shared<std::vector<ReducedSolver>>();
  for (const auto& frame : frames_) {
    coordinates.push_back(frame.start);
    solvers->emplace_back(frame.space, PairEnergy(bending_, options_.symmetry), options_.tolerance, options.stop,
                          options_.method);
  }
  const auto beginning = std::make_shared<const std::vector<Eigen::VectorXd>>(coordinates);
  const double scale = options.restore_scale, stiffness = scale > 0 ? stiffness_ / (scale * scale) : 0;
  const double share = pullShare(options_.symmetry);
  const auto average = [=](std::size_t i, const FrameTerms& terms, const FlowFrame& now) {
    auto& solver = (*solvers)[i];
    auto solved = solver.average(terms.shapes, now.coordinates, {(*beginning)[i], share * stiffness * terms.pull});
    return Solved<FlowFrame>({solver.space().ghost(solved.solution), solved.solution}, solved);
  };
  const auto pull = [=](std::size_t i, const FlowFrame& frame) {
    return stiffness * (frame.coordinates - (*beginning)[i]).squaredNorm();
  };
  return SmoothingFlow(space_->topology(), bending_, beginning_, std::move(coordinates), {average, pull}, options);
}

Vertices ReducedCurve::fine(std::size_t i, const FlowFrame& frame) const {
  const auto& own = frames_[i];
  const auto& shared = space_->fine();
  Vertices shape = shared.shape(frame.coordinates.head(shared.dimension()));
  if (own.missing.size() > 0)
    Eigen::Map<Eigen::VectorXd>(shape.data(), shape.size()) += frame.coordinates.tail<1>()[0] * own.missing;
  return apply(alignRigidly(own.space.ghost(frame.coordinates), frame.shape), shape);
}

}  // namespace shaped
