// CHOLMOD's supernodal factorisation behind core/numerics/cholesky.h.
#ifdef SHAPED_SUPERNODAL

#include <cholmod.h>
#include <metis.h>

#include <stdexcept>

#include "core/numerics/cholesky.h"
#include "core/numerics/interruptible_blas.h"
#include "core/numerics/long_piece.h"
#include "core/numerics/permuted_pattern.h"
#include "core/numerics/threads.h"

namespace shaped {
namespace {

/// CHOLMOD keeps its workspace in a "common" that no two threads may share.
class ThreadCommon {
 public:
  ThreadCommon() {
    cholmod_start(&common_);
    common_.print = 0;
    common_.quick_return_if_not_posdef = 1;
    common_.nmethods = 1;
    // Supernodes merge a little more eagerly than by default, as three unknowns always come together: a tenth faster.
    common_.nrelax[0] = 8, common_.nrelax[1] = 24, common_.nrelax[2] = 48;
    common_.zrelax[0] = 0.8, common_.zrelax[1] = 0.2, common_.zrelax[2] = 0.05;
  }
  ~ThreadCommon() { cholmod_finish(&common_); }

  static cholmod_common* get() {
    limitOpenMpInThisThread();
    thread_local ThreadCommon instance;
    return &instance.common_;
  }

 private:
  cholmod_common common_;
};

struct FreeFactor {
  void operator()(cholmod_factor* factor) const { cholmod_free_factor(&factor, ThreadCommon::get()); }
};
using FactorPtr = std::unique_ptr<cholmod_factor, FreeFactor>;

/// A view of compressed columns of which only the lower triangle counts; CHOLMOD reads, never writes, through it.
cholmod_sparse sparseView(std::size_t n, const std::vector<int>& begin, const std::vector<int>& rows, double* values) {
  cholmod_sparse view{};
  view.nrow = view.ncol = n;
  view.nzmax = rows.size();
  view.p = const_cast<int*>(begin.data());
  view.i = const_cast<int*>(rows.data());
  view.x = values;
  view.stype = -1;
  view.itype = CHOLMOD_INT;
  view.xtype = values ? CHOLMOD_REAL : CHOLMOD_PATTERN;
  view.dtype = CHOLMOD_DOUBLE;
  view.sorted = view.packed = 1;
  return view;
}

cholmod_dense denseView(std::size_t rows, std::size_t columns, double* values) {
  cholmod_dense view{};
  view.nrow = view.d = rows;
  view.ncol = columns;
  view.nzmax = rows * columns;
  view.x = values;
  view.xtype = CHOLMOD_REAL;
  view.dtype = CHOLMOD_DOUBLE;
  return view;
}

/// Symbolic analysis of a lower triangle in the order given (or as it stands), postordered if wanted.
FactorPtr analyse(cholmod_sparse matrix, int* order, bool postorder, int method) {
  const LongPiece piece("symbolic analysis");
  auto* common = ThreadCommon::get();
  common->supernodal = method;
  common->method[0].ordering = order ? CHOLMOD_GIVEN : CHOLMOD_NATURAL;
  common->postorder = postorder;
  FactorPtr factor(cholmod_analyze_p(&matrix, order, nullptr, 0, common));
  if (!factor) throw std::runtime_error("CHOLMOD could not analyse the sparsity pattern");
  return factor;
}

/// METIS nested dissection of the node graph.
std::vector<idx_t> nestedDissection(const BlockPattern& pattern) {
  const LongPiece piece("nested dissection");
  idx_t n = pattern.nodeCount();
  std::vector<idx_t> begin{0}, neighbours;
  for (std::int32_t node = 0; node < n; ++node) {
    for (const auto row : pattern.rows(node))
      if (row != node) neighbours.push_back(row);
    begin.push_back(static_cast<idx_t>(neighbours.size()));
  }
  std::vector<idx_t> order(static_cast<std::size_t>(n)), inverse(static_cast<std::size_t>(n));
  if (METIS_NodeND(&n, begin.data(), neighbours.data(), nullptr, nullptr, order.data(), inverse.data()) != METIS_OK)
    throw std::runtime_error("METIS could not order a matrix of " + std::to_string(n) + " nodes");
  return order;
}

/// Nested dissection followed by a postorder of the elimination tree, which supernodes need. The three unknowns of a
/// node form a chain in the tree of unknowns, so the nodes' postorder is theirs too.
std::vector<std::int32_t> eliminationOrder(const BlockPattern& pattern) {
  std::vector<int> begin{0}, rows;
  for (std::int32_t column = 0; column < pattern.nodeCount(); ++column) {
    const auto lower = pattern.lowerRows(column);
    rows.insert(rows.end(), lower.begin(), lower.end());
    begin.push_back(static_cast<int>(rows.size()));
  }
  auto dissection = nestedDissection(pattern);
  const auto n = static_cast<std::size_t>(pattern.nodeCount());
  const auto tree = analyse(sparseView(n, begin, rows, nullptr), dissection.data(), true, CHOLMOD_SIMPLICIAL);
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
  FactorPtr symbolic;
};

CholeskyAnalysis::CholeskyAnalysis(BlockPatternPtr pattern)
    : pattern_(std::move(pattern)), impl_(new Impl{{*pattern_, eliminationOrder(*pattern_)}, nullptr}) {
  const auto& p = impl_->permuted;
  impl_->symbolic = analyse(sparseView(p.size(), p.begin(), p.rows(), nullptr), nullptr, false, CHOLMOD_SUPERNODAL);
}

CholeskyAnalysis::~CholeskyAnalysis() = default;

struct CholeskyFactor::Impl {
  CholeskyAnalysisPtr analysis;
  FactorPtr factor;
  Pins held;

  const PermutedPattern& permuted() const { return analysis->impl_->permuted; }
};

CholeskyFactor::CholeskyFactor(CholeskyAnalysisPtr analysis) : impl_(new Impl{std::move(analysis), nullptr, {}}) {
  impl_->factor.reset(cholmod_copy_factor(impl_->analysis->impl_->symbolic.get(), ThreadCommon::get()));
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
  auto* common = ThreadCommon::get();
  auto view = sparseView(permuted.size(), permuted.begin(), permuted.rows(), values);
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
  auto* common = ThreadCommon::get();
  auto solution = denseView(n, count, permuted), work = denseView(work_size, 1, scratch(work_memory, work_size));
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
