#ifdef SHAPED_SUPERNODAL

#include "core/numerics/metis_isolation.h"

#include <csignal>
#include <cstdlib>
#include <random>

namespace shaped {
namespace {

std::mutex one_at_a_time;
thread_local bool isolated = false;
thread_local std::minstd_rand generator;

}  // namespace

MetisIsolation::MetisIsolation() : alone_(one_at_a_time) {
  isolated = true;
  generator.seed(1);
}

MetisIsolation::~MetisIsolation() { isolated = false; }

}  // namespace shaped

// Found before the C library's by METIS, which is a shared library; for all others they do what those do.
extern "C" {
int rand() noexcept {
  return static_cast<int>(shaped::isolated ? shaped::generator() : static_cast<unsigned long>(random()));
}

void srand(unsigned seed) noexcept {
  if (shaped::isolated)
    shaped::generator.seed(seed);
  else
    srandom(seed);
}

/// signal() as System V has it: the handler is gone once it was called.
sighandler_t __sysv_signal(int signal, sighandler_t handler) noexcept {
  struct sigaction before {
  }, after{};
  if (shaped::isolated && signal == SIGTERM) return SIG_DFL;
  after.sa_handler = handler;
  after.sa_flags = SA_RESETHAND | SA_NODEFER;
  return sigaction(signal, &after, &before) == 0 ? before.sa_handler : SIG_ERR;
}
}

#endif
