#include "core/numerics/interruptible_blas.h"

namespace shaped {
namespace {

thread_local const std::stop_token* watched = nullptr;

}  // namespace

InterruptibleBlas::InterruptibleBlas(const std::stop_token& stop) { watched = &stop; }
InterruptibleBlas::~InterruptibleBlas() { watched = nullptr; }

}  // namespace shaped

#ifdef SHAPED_WRAPPED_BLAS

namespace {

/// A token stays fired: once a kernel has been left out, all that follow are.
bool skip() { return shaped::watched && shaped::watched->stop_requested(); }

}  // namespace

// Fortran's interface, as CHOLMOD calls it: without the lengths of the character arguments.
extern "C" {
void __real_dpotrf_(const char* uplo, const int* n, double* a, const int* lda, int* info);
void __real_dsyrk_(const char* uplo, const char* trans, const int* n, const int* k, const double* alpha,
                   const double* a, const int* lda, const double* beta, double* c, const int* ldc);
void __real_dgemm_(const char* transa, const char* transb, const int* m, const int* n, const int* k,
                   const double* alpha, const double* a, const int* lda, const double* b, const int* ldb,
                   const double* beta, double* c, const int* ldc);
void __real_dtrsm_(const char* side, const char* uplo, const char* trans, const char* diag, const int* m, const int* n,
                   const double* alpha, const double* a, const int* lda, double* b, const int* ldb);

void __wrap_dpotrf_(const char* uplo, const int* n, double* a, const int* lda, int* info) {
  if (skip())
    *info = 1;  // "not positive definite", at which CHOLMOD returns
  else
    __real_dpotrf_(uplo, n, a, lda, info);
}

void __wrap_dsyrk_(const char* uplo, const char* trans, const int* n, const int* k, const double* alpha,
                   const double* a, const int* lda, const double* beta, double* c, const int* ldc) {
  if (!skip()) __real_dsyrk_(uplo, trans, n, k, alpha, a, lda, beta, c, ldc);
}

void __wrap_dgemm_(const char* transa, const char* transb, const int* m, const int* n, const int* k,
                   const double* alpha, const double* a, const int* lda, const double* b, const int* ldb,
                   const double* beta, double* c, const int* ldc) {
  if (!skip()) __real_dgemm_(transa, transb, m, n, k, alpha, a, lda, b, ldb, beta, c, ldc);
}

void __wrap_dtrsm_(const char* side, const char* uplo, const char* trans, const char* diag, const int* m, const int* n,
                   const double* alpha, const double* a, const int* lda, double* b, const int* ldb) {
  if (!skip()) __real_dtrsm_(side, uplo, trans, diag, m, n, alpha, a, lda, b, ldb);
}
}

#endif
