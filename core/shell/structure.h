#pragma once

#include <array>
#include <memory>

#include "core/mesh/topology.h"
#include "core/numerics/cholesky.h"

namespace shaped {

/// Where the 3 x 3 block of two stencil vertices lives in a SymmetricBlockMatrix: the lower slot, the stencil positions
/// of its row and column, and whether they are swapped because the first vertex has the smaller index.
struct LowerSlot {
  std::int32_t slot;
  std::uint8_t row, column;
  bool transposed;
};

/// What every shell computation over one topology shares: sparsity pattern, slot maps and symbolic factorisation.
/// Built once; immutable.
class ShellStructure {
 public:
  explicit ShellStructure(TopologyPtr topology);
  /// The same; null once the stop token has fired.
  static std::shared_ptr<const ShellStructure> make(TopologyPtr topology, const std::stop_token& stop);

  const Topology& topology() const { return *topology_; }
  const TopologyPtr& topologyPtr() const { return topology_; }
  const BlockPatternPtr& pattern() const { return analysis_->pattern(); }
  const CholeskyAnalysisPtr& analysis() const { return analysis_; }

  /// Blocks (0,0) (1,1) (2,2), then (2,1) (0,2) (1,0), at the edges opposite corners 0, 1, 2, of each face's corners.
  const std::vector<std::array<LowerSlot, 6>>& faceSlots() const { return face_slots_; }
  /// Blocks (i,i), then (1,0) (2,0) (3,0) (2,1) (3,1) (3,2) of each hinge's vertices.
  const std::vector<std::array<LowerSlot, 10>>& hingeSlots() const { return hinge_slots_; }
  /// Slots of a GeneralBlockMatrix, entry 3 r + c (faces) or 4 r + c (hinges) for the block of vertices (r, c).
  const std::vector<std::array<std::int32_t, 9>>& faceGeneralSlots() const { return face_general_slots_; }
  const std::vector<std::array<std::int32_t, 16>>& hingeGeneralSlots() const { return hinge_general_slots_; }

 private:
  ShellStructure(TopologyPtr topology, CholeskyAnalysisPtr analysis);

  TopologyPtr topology_;
  CholeskyAnalysisPtr analysis_;
  std::vector<std::array<LowerSlot, 6>> face_slots_;
  std::vector<std::array<LowerSlot, 10>> hinge_slots_;
  std::vector<std::array<std::int32_t, 9>> face_general_slots_;
  std::vector<std::array<std::int32_t, 16>> hinge_general_slots_;
};

using ShellStructurePtr = std::shared_ptr<const ShellStructure>;

/// Six unknowns whose fixing removes exactly the rigid motions near `shape` (V x 3): all of one vertex, two of a far
/// one, one of a third away from their line. The topology must have one component.
Pins gaugePins(const Vertices& shape);

}  // namespace shaped
