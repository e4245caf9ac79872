#pragma once

#include <stop_token>

namespace shaped {

/// While it lives, the dense kernels that this thread's CHOLMOD calls look at a stop token, and do nothing once it has
/// fired: a factorisation then ends at its next pivot block as if that were not positive definite, a solve runs through
/// without its arithmetic. What they leave behind is not to be used. At most one at a time in a thread.
///
/// CHOLMOD itself cannot be interrupted. The linker leads its calls of dpotrf, dsyrk, dgemm and dtrsm here (--wrap, see
/// cmake/ShapedDependencies.cmake), which it can where CHOLMOD comes as an archive; where not, nothing looks.
class InterruptibleBlas {
 public:
  explicit InterruptibleBlas(const std::stop_token& stop);
  ~InterruptibleBlas();
  InterruptibleBlas(const InterruptibleBlas&) = delete;
  InterruptibleBlas& operator=(const InterruptibleBlas&) = delete;
};

}  // namespace shaped
