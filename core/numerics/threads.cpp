#include "core/numerics/threads.h"

#include <omp.h>

extern "C" void openblas_set_num_threads(int);

namespace shaped {

void limitLibraryThreads() {
  openblas_set_num_threads(1);
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
