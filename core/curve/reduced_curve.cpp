#include "core/curve/reduced_curve.h"

#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>

#include "core/curve/reduced_average.h"
#include "core/numerics/bfgs.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

constexpr std::size_t kGhostShapes = 8;  ///< that the ghost mesh is made for, spread over the curve

/// The rows of a 3V x d basis that belong to these vertices.
Eigen::MatrixXd rowsOf(const Eigen::MatrixXd& basis, const std::vector<std::int32_t>& vertices) {
  Eigen::MatrixXd rows(3 * static_cast<Eigen::Index>(vertices.size()), basis.cols());
  for (std::size_t i = 0; i < vertices.size(); ++i)
    rows.middleRows<3>(3 * static_cast<Eigen::Index>(i)) = basis.middleRows<3>(3 * vertices[i]);
  return rows;
}

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
  const auto central = centralShape(curve.frames);
  ghost_ = coarsen(topology, ghostShapes(curve, central), {options.ghost_vertices, {}, options.stop});
  structure_ = std::make_shared<const ShellStructure>(ghost_.coarse);

  std::vector<Vertices> aligned(curve.size());
  tbb::parallel_for(std::size_t{0}, curve.size(), [&](std::size_t i) {
    aligned[i] = apply(alignRigidly(curve.frames[i], curve.frames[central]), curve.frames[i]);
  });
  shared_ = principalSubspace(curve.frames[central], aligned, options.dimension);
  ghost_origin_ = restrictTo(ghost_, shared_.origin);
  tbb::parallel_for(std::size_t{0}, curve.size(), [&](std::size_t i) { makeFrame(aligned[i], frames_[i]); });

  beginning_.closed = curve.closed;
  for (const auto& frame : curve.frames) beginning_.frames.push_back(restrictTo(ghost_, frame));
}

void ReducedCurve::makeFrame(const Vertices& aligned, Frame& frame) const {
  const auto own = including(shared_, aligned);
  frame.start = own.coordinates(aligned);
  frame.ghost_basis = rowsOf(own.basis, ghost_.kept);
  if (own.dimension() > shared_.dimension()) frame.missing = own.basis.rightCols<1>();
}

Vertices ReducedCurve::ghostShape(const Frame& frame, const Eigen::VectorXd& coordinates) const {
  Vertices shape = ghost_origin_;
  Eigen::Map<Eigen::VectorXd>(shape.data(), shape.size()).noalias() += frame.ghost_basis * coordinates;
  return shape;
}

SmoothingFlow ReducedCurve::flow(const SmoothingFlowOptions& options) {
  std::vector<Eigen::VectorXd> coordinates;
  for (const auto& frame : frames_) coordinates.push_back(frame.start);
  return SmoothingFlow(
      ghost_.coarse, bending_, beginning_, std::move(coordinates),
      [this](std::size_t i, const std::vector<AverageTerm>& terms, const FlowFrame& now) {
        return average(i, terms, now);
      },
      options);
}

Solved<FlowFrame> ReducedCurve::average(std::size_t i, const std::vector<AverageTerm>& terms, const FlowFrame& now) {
  auto& frame = frames_[i];
  ReducedAverage function(*structure_, {bending_, options_.symmetry}, terms, ghost_origin_, frame.ghost_basis);
  if (frame.inverse.size() == 0) {
    const Eigen::MatrixXd hessian = function.hessian(now.coordinates);
    const Eigen::MatrixXd ridge = 1e-10 * hessian.trace() * Eigen::MatrixXd::Identity(hessian.rows(), hessian.cols());
    frame.inverse = (hessian + ridge).llt().solve(Eigen::MatrixXd::Identity(hessian.rows(), hessian.cols()));
  }
  Eigen::VectorXd gradient;
  const double reference = std::max(function(now.coordinates, gradient), function.noise());
  const BfgsOptions options{60, options_.tolerance, reference, function.noise(), options_.stop};
  auto solved = minimiseBfgs(std::ref(function), now.coordinates, frame.inverse, options);
  return {{ghostShape(frame, solved.solution), solved.solution}, solved};
}

Vertices ReducedCurve::fine(std::size_t i, const FlowFrame& frame) const {
  const auto& own = frames_[i];
  Vertices shape = shared_.shape(frame.coordinates.head(shared_.dimension()));
  if (own.missing.size() > 0)
    Eigen::Map<Eigen::VectorXd>(shape.data(), shape.size()) += frame.coordinates.tail<1>()[0] * own.missing;
  return apply(alignRigidly(ghostShape(own, frame.coordinates), frame.shape), shape);
}

}  // namespace shaped
