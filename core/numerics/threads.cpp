#include "core/numerics/threads.h"

#include <omp.h>

extern "C" void openblas_set_num_threads(int);
// Exported, though in no header; weak, for a build of OpenBLAS that has no threads.
extern "C" __attribute__((weak)) int blas_thread_shutdown_();

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
