// CHOLMOD's supernodal factorisation behind core/numerics/cholesky.h.
#ifdef SHAPED_SUPERNODAL

#include <stdexcept>

#include "core/numerics/cholesky.h"
#include "core/numerics/cholmod_support.h"
#include "core/numerics/interruptible_blas.h"
#include "core/numerics/long_piece.h"
#include "core/numerics/nested_dissection.h"
#include "core/numerics/permuted_pattern.h"

namespace shaped {
namespace {

/// Nested dissection followed by a postorder of the elimination tree, which supernodes need. The three unknowns of a
/// node form a chain in the tree of unknowns, so the nodes' postorder is theirs too. Empty once the token has fired.
std::vector<std::int32_t> eliminationOrder(const BlockPattern& pattern, const std::stop_token& stop) {
  auto dissection = nestedDissection(pattern, stop);
  if (stop.stop_requested()) return {};
  std::vector<int> begin{0}, rows;
  for (std::int32_t column = 0; column < pattern.nodeCount(); ++column) {
    const auto lower = pattern.lowerRows(column);
    rows.insert(rows.end(), lower.begin(), lower.end());
    begin.push_back(static_cast<int>(rows.size()));
  }
  const auto n = static_cast<std::size_t>(pattern.nodeCount());
  const auto tree =
      analyseInOrder(cholmodLower(n, begin.data(), rows.data(), nullptr), dissection.data(), CHOLMOD_SIMPLICIAL);
  const auto* order = static_cast<const int*>(tree->Perm);
  return {order, order + n};
}

/// Memory that lives as long as the thread: a preconditioner solves thousands of times.
double* scratch(std::vector<double>& memory, std::size_t size) {
  if (memory.size() < size) memory.resize(size);
  return memory.data();
}

}  // namespace

struct CholeskyAnalysis::Impl {
  PermutedPattern permuted;
  CholmodFactorPtr symbolic;
};

std::shared_ptr<const CholeskyAnalysis::Impl> CholeskyAnalysis::analyse(const BlockPattern& pattern,
                                                                        const std::stop_token& stop) {
  auto order = eliminationOrder(pattern, stop);
  if (stop.stop_requested()) return nullptr;
  const std::shared_ptr<Impl> impl(new Impl{{pattern, std::move(order)}, nullptr});
  if (stop.stop_requested()) return nullptr;
  const auto& p = impl->permuted;
  impl->symbolic =
      analyseAsItStands(cholmodLower(p.size(), p.begin().data(), p.rows().data(), nullptr), CHOLMOD_SUPERNODAL);
  return impl;
}

struct CholeskyFactor::Impl {
  CholeskyAnalysisPtr analysis;
  CholmodFactorPtr factor;
  Pins held;

  const PermutedPattern& permuted() const { return analysis->impl_->permuted; }
};

CholeskyFactor::CholeskyFactor(CholeskyAnalysisPtr analysis) : impl_(new Impl{std::move(analysis), nullptr, {}}) {
  impl_->factor.reset(cholmod_copy_factor(impl_->analysis->impl_->symbolic.get(), cholmodOfThisThread()));
  if (!impl_->factor) throw std::bad_alloc();
}

CholeskyFactor::~CholeskyFactor() = default;
CholeskyFactor::CholeskyFactor(CholeskyFactor&&) noexcept = default;
CholeskyFactor& CholeskyFactor::operator=(CholeskyFactor&&) noexcept = default;

bool CholeskyFactor::factorise(const SymmetricBlockMatrix& matrix, const Pins& pins, const std::stop_token& stop) {
  if (stop.stop_requested()) return false;
  const LongPiece piece("factorisation");
  thread_local std::vector<double> memory;
  const auto& permuted = impl_->permuted();
  double* values = scratch(memory, permuted.rows().size());
  permuted.copyValues(matrix, pins, values);
  impl_->held = pins;
  const Eigen::Map<const Eigen::VectorXd> all(values, static_cast<Eigen::Index>(permuted.rows().size()));
  if ((0 * all).sum() != 0) return false;  // NaN when an entry is not finite, which BLAS would not notice
  auto* common = cholmodOfThisThread();
  auto view = cholmodLower(permuted.size(), permuted.begin().data(), permuted.rows().data(), values);
  const InterruptibleBlas blas(stop);
  return cholmod_factorize(&view, impl_->factor.get(), common) && common->status == CHOLMOD_OK &&
         impl_->factor->minor == impl_->factor->n && !stop.stop_requested();
}

void CholeskyFactor::solve(const double* b, double* x, int columns, const std::stop_token& stop) const {
  const LongPiece piece("solve");
  thread_local std::vector<double> permuted_memory, work_memory;
  const auto n = impl_->permuted().size(), count = static_cast<std::size_t>(columns);
  double* permuted = scratch(permuted_memory, n * count);
  const std::size_t work_size = impl_->factor->maxesize * count;
  for (std::size_t c = 0; c < count; ++c) impl_->permuted().permute(b + n * c, permuted + n * c);
  auto* common = cholmodOfThisThread();
  auto solution = cholmodDense(n, count, permuted), work = cholmodDense(work_size, 1, scratch(work_memory, work_size));
  const InterruptibleBlas blas(stop);
  if (!cholmod_super_lsolve(impl_->factor.get(), &solution, &work, common) ||
      !cholmod_super_ltsolve(impl_->factor.get(), &solution, &work, common))
    throw std::runtime_error("CHOLMOD could not solve with a factor");
  for (std::size_t c = 0; c < count; ++c) {
    impl_->permuted().permuteBack(permuted + n * c, x + n * c);
    impl_->held.clear(x + n * c);
  }
}

}  // namespace shaped

#endif
