#ifdef SHAPED_SUPERNODAL

#include "core/numerics/cholmod_support.h"

#include <stdexcept>

#include "core/numerics/long_piece.h"
#include "core/numerics/threads.h"

namespace shaped {
namespace {

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

  cholmod_common* get() { return &common_; }

 private:
  cholmod_common common_;
};

CholmodFactorPtr analyse(cholmod_sparse matrix, int ordering, int* order, bool postorder, int method) {
  const LongPiece piece("symbolic analysis");
  auto* common = cholmodOfThisThread();
  common->supernodal = method;
  common->method[0].ordering = ordering;
  common->postorder = postorder;
  CholmodFactorPtr factor(cholmod_analyze_p(&matrix, order, nullptr, 0, common));
  if (!factor) throw std::runtime_error("CHOLMOD could not analyse the sparsity pattern");
  return factor;
}

}  // namespace

cholmod_common* cholmodOfThisThread() {
  limitOpenMpInThisThread();
  thread_local ThreadCommon instance;
  return instance.get();
}

cholmod_sparse cholmodLower(std::size_t n, const int* begin, const int* rows, const double* values) {
  cholmod_sparse view{};
  view.nrow = view.ncol = n;
  view.nzmax = static_cast<std::size_t>(begin[n]);
  view.p = const_cast<int*>(begin);
  view.i = const_cast<int*>(rows);
  view.x = const_cast<double*>(values);
  view.stype = -1;
  view.itype = CHOLMOD_INT;
  view.xtype = values ? CHOLMOD_REAL : CHOLMOD_PATTERN;
  view.dtype = CHOLMOD_DOUBLE;
  view.sorted = view.packed = 1;
  return view;
}

cholmod_dense cholmodDense(std::size_t rows, std::size_t columns, double* values) {
  cholmod_dense view{};
  view.nrow = view.d = rows;
  view.ncol = columns;
  view.nzmax = rows * columns;
  view.x = values;
  view.xtype = CHOLMOD_REAL;
  view.dtype = CHOLMOD_DOUBLE;
  return view;
}

CholmodFactorPtr analyseInOrder(cholmod_sparse matrix, int* order, int method) {
  return analyse(matrix, CHOLMOD_GIVEN, order, true, method);
}

CholmodFactorPtr analyseAsItStands(cholmod_sparse matrix, int method) {
  return analyse(matrix, CHOLMOD_NATURAL, nullptr, false, method);
}

CholmodFactorPtr analyseByDegree(cholmod_sparse matrix, int method) {
  return analyse(matrix, CHOLMOD_AMD, nullptr, true, method);
}

}  // namespace shaped

#endif
