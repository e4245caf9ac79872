#pragma once

// Shared by the files that call CHOLMOD; included by no other.

#include <cholmod.h>

#include <cstddef>
#include <memory>

namespace shaped {

/// The calling thread's CHOLMOD workspace, which no two threads may share. Lives as long as the thread.
cholmod_common* cholmodOfThisThread();

struct FreeCholmodFactor {
  void operator()(cholmod_factor* factor) const { cholmod_free_factor(&factor, cholmodOfThisThread()); }
};
using CholmodFactorPtr = std::unique_ptr<cholmod_factor, FreeCholmodFactor>;

/// A view of an n x n matrix in compressed columns, of which only the lower triangle counts; CHOLMOD reads, never
/// writes, through it. values: null for a pattern.
cholmod_sparse cholmodLower(std::size_t n, const int* begin, const int* rows, const double* values);

/// A view of columns one after another.
cholmod_dense cholmodDense(std::size_t rows, std::size_t columns, double* values);

/// Symbolic analysis; method: CHOLMOD_SIMPLICIAL or CHOLMOD_SUPERNODAL. order: of the unknowns, n of them.
CholmodFactorPtr analyseInOrder(cholmod_sparse matrix, int* order, int method);
/// The same in the order in which the matrix stands, without a postorder.
CholmodFactorPtr analyseAsItStands(cholmod_sparse matrix, int method);
/// The same in the order of approximate minimum degree: quicker to find than a dissection.
CholmodFactorPtr analyseByDegree(cholmod_sparse matrix, int method);

}  // namespace shaped
