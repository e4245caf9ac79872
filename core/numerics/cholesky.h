#pragma once

#include <memory>
#include <stop_token>

#include "core/numerics/block_matrix.h"
#include "core/numerics/pins.h"

namespace shaped {

/// Fill-reducing ordering and symbolic factorisation of one pattern, made once per topology and shared by every factor.
/// METIS orders the nodes; CHOLMOD's supernodal method is used where it is built in, Eigen's simplicial one elsewhere.
class CholeskyAnalysis {
 public:
  explicit CholeskyAnalysis(BlockPatternPtr pattern);
  /// The same; null once the stop token has fired.
  static std::shared_ptr<const CholeskyAnalysis> make(BlockPatternPtr pattern, const std::stop_token& stop);
  CholeskyAnalysis(const CholeskyAnalysis&) = delete;
  CholeskyAnalysis& operator=(const CholeskyAnalysis&) = delete;

  const BlockPatternPtr& pattern() const { return pattern_; }

 private:
  friend class CholeskyFactor;
  struct Impl;
  CholeskyAnalysis(BlockPatternPtr pattern, std::shared_ptr<const Impl> impl);
  /// Null once the stop token has fired.
  static std::shared_ptr<const Impl> analyse(const BlockPattern& pattern, const std::stop_token& stop);

  BlockPatternPtr pattern_;
  std::shared_ptr<const Impl> impl_;
};

using CholeskyAnalysisPtr = std::shared_ptr<const CholeskyAnalysis>;

/// L L^T of P A P plus the identity on pinned unknowns, for matrices over one pattern. One object per thread.
class CholeskyFactor {
 public:
  explicit CholeskyFactor(CholeskyAnalysisPtr analysis);
  ~CholeskyFactor();
  CholeskyFactor(CholeskyFactor&&) noexcept;
  CholeskyFactor& operator=(CholeskyFactor&&) noexcept;

  /// Factorises; false when the matrix restricted to the free unknowns is not positive definite (or not finite), or
  /// when the stop token has fired, and then solve() must not be called. Looks at the token before each dense kernel.
  bool factorise(const SymmetricBlockMatrix& matrix, const Pins& pins, const std::stop_token& stop = {});

  /// x = A^-1 b with zero in the pinned unknowns, whatever b holds there; x and b may be the same, `columns` right-hand
  /// sides one after another. May be called from several threads at once. Once the stop token has fired, x is not to be
  /// used.
  void solve(const double* b, double* x, int columns = 1, const std::stop_token& stop = {}) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace shaped
