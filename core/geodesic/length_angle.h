#pragma once

#include <stop_token>

#include "core/numerics/cholesky.h"
#include "core/numerics/made_once.h"
#include "core/shell/measures.h"

namespace shaped {

/// Rebuilds a shape from wanted edge lengths and hinge angles, which no mesh may realise exactly: face frames that
/// agree best across the hinges (the smallest eigenspace of the connection Laplacian over the faces), then positions by
/// a Poisson solve. The start of Newton's method where shapes bend far; [WLT12], [FB11].
///
/// Symbolic work is done at the first call; const calls may run in parallel. The topology must have one component.
class LengthAngleReconstruction {
 public:
  explicit LengthAngleReconstruction(TopologyPtr topology);

  /// wanted: squared lengths and angles (areas are not read). near: V x 3, a shape of similar pose from which the
  /// frames are iterated and to which the result is rigidly aligned. Empty when the frames could not be solved for, or
  /// the stop token has fired.
  Vertices reconstruct(const ShellMeasures& wanted, const Vertices& near, const std::stop_token& stop = {}) const;

 private:
  TopologyPtr topology_;
  MadeOnce<CholeskyAnalysis> analysis_;               ///< faces as nodes
  std::vector<std::array<std::int32_t, 2>> corners_;  ///< per hinge: in each face, the corner its edge starts from
};

/// (1 - t) a + t b for the angles (the short way round) and the lengths' logarithms; t any real number.
ShellMeasures blendMeasures(const ShellMeasures& a, const ShellMeasures& b, double t);

}  // namespace shaped
