#include "core/numerics/threads.h"

#include <omp.h>

extern "C" void openblas_set_num_threads(int);
// Exported, though in no header; weak, for a build of OpenBLAS that has no threads.
extern "C" __attribute__((weak)) int blas_thread_shutdown_();

#ifdef SHAPED_WRAPPED_BLAS
/// CHOLMOD's loops over a supernode are parallel regions, which are never more than one thread here (below). libgomp
/// makes a team of that one for each, with memory and two calls of the kernel: a tenth of the time of small
/// factorisations. The linker leads them here (--wrap).
extern "C" void __wrap_GOMP_parallel(void (*region)(void*), void* data, unsigned, unsigned) { region(data); }
#endif

namespace shaped {

void limitLibraryThreads() {
  openblas_set_num_threads(1);
  // It started a thread for each further processor before main() began; they would sleep to the end, 100 KB each.
  if (blas_thread_shutdown_) blas_thread_shutdown_();
  omp_set_num_threads(1);
  limitOpenMpInThisThread();
}

void limitOpenMpInThisThread() {
  thread_local const bool done = [] {
    omp_set_max_active_levels(0);
    return true;
  }();
  (void)done;
}

}  // namespace shaped
