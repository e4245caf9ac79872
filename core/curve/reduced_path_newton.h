#pragma once

#include "core/curve/block_tridiagonal.h"
#include "core/curve/curve.h"
#include "core/curve/reduced_path.h"
#include "core/numerics/secant_pairs.h"

namespace shaped {

/// Descends (4) in all inner frames of a path in a subspace at once, by Newton's method: the Hessian has dense blocks
/// on three diagonals and is exact, with a small multiple of one added; where that is not positive definite, each frame
/// steps on its own, with elements that are.
///
/// A Hessian takes as long as dozens of gradients. The factorised one is kept, by later steps and for the next path of
/// as many frames, and brought up to date by SecantPairs, for as long as some such steps leave little of the residual.
/// The residual is sqrt(g^T B g / energy), B the inverse Hessian in use. For one thread at a time; runs parallel loops
/// in the current TBB arena. The space must outlive this.
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

  State stateOf(PathCoordinates path) const;
  State moved(const State& state, const Eigen::VectorXd& step) const;
  /// Of the inner frames, one after the other.
  Eigen::VectorXd gradientAt(const State& state) const;
  /// False where it cannot be made positive definite, or stopped.
  bool factoriseAt(const State& state);
  /// With as small a multiple of one as does it, at most `most` times the diagonal's mean.
  bool factoriseShifted(const std::vector<Eigen::MatrixXd>& diagonal, const std::vector<Eigen::MatrixXd>& above,
                        double most);
  /// Of the Hessian: inner frame k with itself, and with the next.
  Eigen::MatrixXd diagonalBlock(const State& state, std::size_t k, HessianKind kind) const;
  Eigen::MatrixXd blockAbove(const State& state, std::size_t k) const;

  static constexpr std::size_t kPairs = 12;

  const GhostSpace& space_;
  PairEnergy energy_;
  ReducedPathOptions options_;
  VectorBundle basis_;  ///< the space's
  BlockTridiagonalCholesky factor_;
  SecantPairs pairs_{kPairs};
};

}  // namespace shaped
