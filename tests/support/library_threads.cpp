// As the programs do at their start. OpenBLAS's threads and ours would take the processors from each other, and a test of
// many small factorisations then takes a hundred times as long beside others.
#include "core/numerics/blas_kernels.h"
#include "core/numerics/threads.h"

namespace {

[[maybe_unused]] const bool limited = (shaped::useBestBlasKernels(), shaped::limitLibraryThreads(), true);

}  // namespace
