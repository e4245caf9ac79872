// CHOLMOD's supernodal factorisation behind core/numerics/cholesky.h.
#ifdef SHAPED_SUPERNODAL

#include <cholmod.h>
#include <metis.h>

#include <cmath>
#include <stdexcept>

#include "core/numerics/cholesky.h"
#include "core/numerics/threads.h"

namespace shaped {
namespace {

/// CHOLMOD keeps its workspace in a "common" that no two threads may share.
class ThreadCommon {
 public:
  ThreadCommon() {
    cholmod_start(&common_);
    common_.supernodal = CHOLMOD_SUPERNODAL;
    common_.print = 0;
    common_.quick_return_if_not_posdef = 1;
    common_.nmethods = 1;
    common_.method[0].ordering = CHOLMOD_GIVEN;
    common_.postorder = 1;
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

using SparsePtr = std::unique_ptr<cholmod_sparse, void (*)(cholmod_sparse*)>;

void freeSparse(cholmod_sparse* matrix) { cholmod_free_sparse(&matrix, ThreadCommon::get()); }
void freeFactor(cholmod_factor* factor) { cholmod_free_factor(&factor, ThreadCommon::get()); }

/// Scalar compressed columns of the lower block triangle (the strict upper part of diagonal blocks is ignored by
/// CHOLMOD); values are left unset.
SparsePtr makeScalarPattern(const BlockPattern& pattern) {
  const auto n = static_cast<std::size_t>(pattern.nodeCount()) * 3;
  const auto entries = static_cast<std::size_t>(pattern.lowerBlockCount()) * 9;
  SparsePtr matrix(cholmod_allocate_sparse(n, n, entries, 1, 1, -1, CHOLMOD_REAL, ThreadCommon::get()), freeSparse);
  if (!matrix) throw std::bad_alloc();
  auto* begin = static_cast<int*>(matrix->p);
  auto* index = static_cast<int*>(matrix->i);
  int next = 0;
  for (std::int32_t column = 0; column < pattern.nodeCount(); ++column)
    for (int c = 0; c < 3; ++c) {
      *begin++ = next;
      for (const auto row : pattern.lowerRows(column))
        for (int r = 0; r < 3; ++r) index[next++] = 3 * row + r;
    }
  *begin = next;
  return matrix;
}

/// METIS nested dissection of the node graph, each node then standing for its three unknowns.
std::vector<int> nestedDissection(const BlockPattern& pattern) {
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
  std::vector<int> expanded;
  expanded.reserve(order.size() * 3);
  for (const auto node : order)
    for (int axis = 0; axis < 3; ++axis) expanded.push_back(static_cast<int>(3 * node + axis));
  return expanded;
}

}  // namespace

struct CholeskyAnalysis::Impl {
  cholmod_factor* symbolic = nullptr;
  ~Impl() {
    if (symbolic) freeFactor(symbolic);
  }
};

CholeskyAnalysis::CholeskyAnalysis(BlockPatternPtr pattern)
    : pattern_(std::move(pattern)), impl_(std::make_unique<Impl>()) {
  const auto matrix = makeScalarPattern(*pattern_);
  std::fill_n(static_cast<double*>(matrix->x), matrix->nzmax, 0.0);
  auto order = nestedDissection(*pattern_);
  impl_->symbolic = cholmod_analyze_p(matrix.get(), order.data(), nullptr, 0, ThreadCommon::get());
  if (!impl_->symbolic) throw std::runtime_error("CHOLMOD could not analyse the sparsity pattern");
}

CholeskyAnalysis::~CholeskyAnalysis() = default;

struct CholeskyFactor::Impl {
  CholeskyAnalysisPtr analysis;
  SparsePtr matrix;
  Pins held;
  cholmod_factor* factor = nullptr;
  ~Impl() {
    if (factor) freeFactor(factor);
  }

  void copyValues(const SymmetricBlockMatrix& source, const Pins& pins);
  bool finite() const;
};

CholeskyFactor::CholeskyFactor(CholeskyAnalysisPtr analysis)
    : impl_(new Impl{std::move(analysis), SparsePtr(nullptr, freeSparse), {}}) {
  impl_->factor = cholmod_copy_factor(impl_->analysis->impl_->symbolic, ThreadCommon::get());
  if (!impl_->factor) throw std::bad_alloc();
}

CholeskyFactor::~CholeskyFactor() = default;
CholeskyFactor::CholeskyFactor(CholeskyFactor&&) noexcept = default;
CholeskyFactor& CholeskyFactor::operator=(CholeskyFactor&&) noexcept = default;

void CholeskyFactor::Impl::copyValues(const SymmetricBlockMatrix& source, const Pins& pins) {
  const auto& pattern = source.pattern();
  auto* out = static_cast<double*>(matrix->x);
  for (std::int32_t column = 0; column < pattern.nodeCount(); ++column) {
    const auto rows = pattern.lowerRows(column);
    const auto first = pattern.lowerBegin(column);
    for (int c = 0; c < 3; ++c) {
      const bool column_pinned = pins.pinned(3 * static_cast<std::size_t>(column) + static_cast<std::size_t>(c));
      for (std::size_t k = 0; k < rows.size(); ++k) {
        const double* block = source.block(first + static_cast<std::int32_t>(k)) + 3 * c;
        const bool clean = !column_pinned && !pins.anyPinned(rows[k]);
        for (int r = 0; r < 3; ++r) {
          const bool keep = clean || (!column_pinned && !pins.pinned(3 * static_cast<std::size_t>(rows[k]) + static_cast<std::size_t>(r)));
          const bool unit = column_pinned && rows[k] == column && r == c;
          *out++ = keep ? block[r] : (unit ? 1.0 : 0.0);
        }
      }
    }
  }
}

bool CholeskyFactor::Impl::finite() const {
  const auto* values = static_cast<const double*>(matrix->x);
  double sum = 0;
  for (std::size_t i = 0; i < matrix->nzmax; ++i) sum += values[i] * 0.0;
  return sum == 0.0;
}

bool CholeskyFactor::factorise(const SymmetricBlockMatrix& matrix, const Pins& pins) {
  impl_->matrix = makeScalarPattern(matrix.pattern());
  impl_->copyValues(matrix, pins);
  const bool finite = impl_->finite();
  auto* common = ThreadCommon::get();
  const bool done = finite && cholmod_factorize(impl_->matrix.get(), impl_->factor, common) &&
                    common->status == CHOLMOD_OK && impl_->factor->minor == impl_->factor->n;
  impl_->matrix.reset();
  impl_->held = pins;
  return done;
}

void CholeskyFactor::solve(const double* b, double* x, int columns) const {
  auto* common = ThreadCommon::get();
  const auto n = impl_->factor->n;
  cholmod_dense rhs{};
  rhs.nrow = rhs.d = n;
  rhs.ncol = static_cast<std::size_t>(columns);
  rhs.nzmax = n * rhs.ncol;
  rhs.x = const_cast<double*>(b);
  rhs.xtype = CHOLMOD_REAL;
  rhs.dtype = CHOLMOD_DOUBLE;
  // Workspaces live as long as the thread: a preconditioner calls this thousands of times.
  thread_local struct Workspace {
    cholmod_dense *x = nullptr, *y = nullptr, *e = nullptr;
    ~Workspace() {
      for (auto** dense : {&x, &y, &e}) cholmod_free_dense(dense, ThreadCommon::get());
    }
  } work;
  if (!cholmod_solve2(CHOLMOD_A, impl_->factor, &rhs, nullptr, &work.x, nullptr, &work.y, &work.e, common))
    throw std::runtime_error("CHOLMOD could not solve with a factor");
  const auto* solution = static_cast<const double*>(work.x->x);
  std::copy(solution, solution + n * rhs.ncol, x);
  for (std::size_t column = 0; column < rhs.ncol; ++column) impl_->held.clear(x + n * column);
}

}  // namespace shaped

#endif
