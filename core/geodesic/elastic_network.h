#pragma once

#include <functional>
#include <stop_token>
#include <vector>

#include "core/numerics/solved.h"
#include "core/shell/pair_energy.h"
#include "core/shell/structure.h"

namespace shaped {

/// One elastic segment of a network: weight W[nodes[from], nodes[to]].
struct ElasticSegment {
  std::int32_t from, to;
  double weight;
};

/// Shapes joined by elastic segments; the energy is the sum over segments of weight W[from, to]. Discrete geodesics
/// ([HZRS18] (7)) and the polygonal spider of the Frechet mean (10) are such networks.
///
/// The segments between free nodes must form a forest.
struct ElasticNetwork {
  std::vector<Vertices> nodes;
  std::vector<bool> free;  ///< per node: may it move?
  std::vector<ElasticSegment> segments;
};

struct NetworkOptions {
  int max_iterations = 60;
  double tolerance = 1e-8;  ///< on the largest relative force imbalance over free nodes, > 0
  std::stop_token stop;
  std::function<void(int iteration, double residual)> on_iteration;  ///< before each step, may be empty
  /// Sees each iterate before its step, and the last one again when the stop token has fired; may be empty.
  std::function<void(const Outcome& so_far, const ElasticNetwork& iterate)> on_iterate = {};
};

/// Descends the network's energy in all free nodes at once by a truncated Newton method.
///
/// Each Newton system is solved by conjugate gradients on the exact Hessian. The preconditioner eliminates the forest
/// from its leaves with one factorised block a node, scaled by the pivots of the scalar graph Laplacian: exact where
/// neighbouring shapes have the same Hessian, so few iterations suffice. Directions of negative curvature end the inner
/// iteration; a line search on the energy guards every step.
///
/// The residual is, over free nodes, the largest ratio of the norm of the node's gradient to the sum of the norms of
/// its segments' forces: 0 where the forces balance. Runs parallel loops over nodes in the current TBB arena; the
/// result does not depend on the number of threads. Cancellation is polled at every node of every stage; a step that it
/// interrupts is not taken. Rigid motions of the free nodes stay as they were at the start up to the six unknowns pinned.
Solved<ElasticNetwork> relax(const ShellStructurePtr& structure, const PairEnergy& energy, ElasticNetwork network,
                             const NetworkOptions& options);

/// The energies W of the segments, without their weights [m^2].
std::vector<double> segmentEnergies(const Topology& topology, const PairEnergy& energy, const ElasticNetwork& network);

}  // namespace shaped
