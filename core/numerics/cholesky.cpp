#include "core/numerics/cholesky.h"

namespace shaped {

CholeskyAnalysis::CholeskyAnalysis(BlockPatternPtr pattern)
    : pattern_(std::move(pattern)), impl_(analyse(*pattern_, {})) {}

CholeskyAnalysis::CholeskyAnalysis(BlockPatternPtr pattern, std::shared_ptr<const Impl> impl)
    : pattern_(std::move(pattern)), impl_(std::move(impl)) {}

std::shared_ptr<const CholeskyAnalysis> CholeskyAnalysis::make(BlockPatternPtr pattern, const std::stop_token& stop) {
  auto impl = analyse(*pattern, stop);
  if (!impl) return nullptr;
  return std::shared_ptr<const CholeskyAnalysis>(new CholeskyAnalysis(std::move(pattern), std::move(impl)));
}

}  // namespace shaped
