#pragma once

#include "core/curve/block_tridiagonal.h"
#include "core/curve/curve.h"
#include "core/curve/reduced_path.h"

namespace shaped {

/// Descends (4) in all inner frames of a path in a subspace at once, by Newton's method: the Hessian has dense blocks
/// on three diagonals and is exact, with a small multiple of one added; where that is not positive definite, each frame
/// steps on its own, with elements that are.
///
/// The factorised Hessian is kept: later steps, and the next path of as many frames, use it for as long as each step
/// with it leaves at most a third of the residual. The residual is sqrt(g^T B g / energy), B the inverse Hessian in
/// use. For one thread at a time; runs parallel loops in the current TBB arena. The space must outlive this.
class ReducedPathNewton {
 public:
  ReducedPathNewton(const GhostSpace& space, double bending, const ReducedPathOptions& options)
      : space_(space), energy_(bending, EnergySymmetry::kSymmetric), options_(options) {}

  /// Stalled: rounding hides what is left to gain, or no step lowers (4). Numerical failure: a frame is degenerate.
  Outcome settle(PathCoordinates& path);

 private:
  struct State {
    PathCoordinates path;
    Curve curve;  ///< on the ghost mesh
    std::vector<ShellMeasures> measures;
    double energy = 0, noise = 0;  ///< (4) and its rounding error [m^2]
  };
  struct Step {
    bool found = false, fresh = false;     ///< fresh: by the Hessian of where the path is now
    std::vector<Eigen::VectorXd> descent;  ///< to be subtracted from the inner frames
    double residual = 0;
  };

  State stateOf(PathCoordinates path) const;
  std::vector<Eigen::VectorXd> gradientAt(const State& state) const;
  /// With the kept factor where the last step, of such a residual, was a good one; 0: without it.
  Step stepFrom(const State& state, const std::vector<Eigen::VectorXd>& gradient, double last);
  /// False where it cannot be made positive definite, or stopped.
  bool factoriseAt(const State& state);
  /// With as small a multiple of one as does it, at most `most` times the diagonal's mean.
  bool factoriseShifted(const std::vector<Eigen::MatrixXd>& diagonal, const std::vector<Eigen::MatrixXd>& above,
                        double most);
  /// Of the Hessian: inner frame k with itself, and with the next.
  Eigen::MatrixXd diagonalBlock(const State& state, std::size_t k, HessianKind kind) const;
  Eigen::MatrixXd blockAbove(const State& state, std::size_t k) const;
  /// Of a matrix on the ghost mesh by its products with the basis.
  template <class Multiply>
  Eigen::MatrixXd projected(const Multiply& multiply) const;

  const GhostSpace& space_;
  PairEnergy energy_;
  ReducedPathOptions options_;
  BlockTridiagonalCholesky factor_;
};

}  // namespace shaped
