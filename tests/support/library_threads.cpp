// As the programs do at their start. OpenBLAS's threads and ours would take the processors from each other, and a test of
// many small factorisations then takes a hundred times as long beside others.
#include "core/numerics/threads.h"
#include "server/daemon/best_kernels.h"

namespace {

[[maybe_unused]] const bool limited = (shaped::server::useBestBlasKernels(), shaped::limitLibraryThreads(), true);

}  // namespace
