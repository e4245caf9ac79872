#pragma once

#include <memory>

#include "core/curve/reduced_solver.h"

namespace shaped {

struct ReducedCurveOptions {
  int dimension = 15;                  ///< of the principal directions that all frames share, >= 1
  std::int32_t ghost_vertices = 1250;  ///< of the mesh on which energies are evaluated, >= 4; no more than there are
  EnergySymmetry symmetry = EnergySymmetry::kDirected;  ///< of the averages: (10), or (1) at twice the cost
  AverageMethod method = AverageMethod::kBfgs;
  double tolerance = 1e-4;  ///< of a frame's solve: sqrt(gain left / energy of its terms), > 0
  std::stop_token stop = {};
};

/// A curve whose frames move in a low-dimensional space each, with energies evaluated on a coarse "ghost" mesh:
/// [BvTH16] section 6. What a step of the flow costs does not depend on the number of vertices.
///
/// Frame i, moved rigidly onto the origin, is origin + U q + s n_i: U holds the principal directions of all frames, n_i
/// what these miss of the frame. A curve of fewer than 20 frames adds its flow tangents (9) to U. The ghost mesh keeps
/// some of the vertices, and so do origin and directions. The averages are minimised by the BFGS method from an inverse
/// Hessian that is computed once for each frame.
class ReducedCurve {
 public:
  /// Throws as requireCurve. Runs parallel loops in the current TBB arena.
  ReducedCurve(const TopologyPtr& topology, double bending, const Curve& curve, const ReducedCurveOptions& options);

  /// A flow of this curve. Its frames are those of the ghost mesh; the ReducedCurve must outlive it.
  SmoothingFlow flow(const SmoothingFlowOptions& options) const;

  /// A frame of the flow at full resolution, where its ghost is. V x 3.
  Vertices fine(std::size_t i, const FlowFrame& frame) const;

  const GhostSpace& space() const { return *space_; }

 private:
  /// What is of one frame alone.
  struct Frame {
    FrameSpace space;
    Eigen::VectorXd missing;  ///< n_i, 3V; empty where the shared directions miss nothing
    Eigen::VectorXd start;    ///< coordinates at the beginning
  };

  Frame frameOf(const Vertices& aligned) const;

  double bending_;
  ReducedCurveOptions options_;
  std::unique_ptr<const GhostSpace> space_;
  std::vector<Frame> frames_;
  Curve beginning_;   ///< on the ghost mesh, placed
  double stiffness_;  ///< pullStiffness() at a scale of one
};

}  // namespace shaped
