#pragma once

#include <string_view>
#include <utility>

namespace shaped {

/// How a solver ended, and what that means for its solution.
enum class Termination {
  kConverged,         ///< the residual is at most the tolerance
  kIterationLimit,    ///< the best iterate; better than the start, short of the tolerance
  kStalled,           ///< no step lowers the objective any more although the residual is above the tolerance
  kCancelled,         ///< the caller's stop token fired; the best iterate so far
  kNumericalFailure,  ///< the start, unchanged: a non-finite value or a singular system
};

constexpr std::string_view name(Termination termination) {
  switch (termination) {
    case Termination::kConverged: return "converged";
    case Termination::kIterationLimit: return "iteration_limit";
    case Termination::kStalled: return "stalled";
    case Termination::kCancelled: return "cancelled";
    case Termination::kNumericalFailure: return "numerical_failure";
  }
  return "unknown";
}

/// How a solve ended, without its solution.
struct Outcome {
  Termination termination = Termination::kConverged;
  int iterations = 0;
  double residual = 0;  ///< in the norm of the solver's tolerance

  bool converged() const { return termination == Termination::kConverged; }

  /// Appends a later stage: iterations add up, the first stage that did not converge names the termination, and the
  /// largest residual is kept.
  Outcome& operator+=(const Outcome& later) {
    if (converged()) termination = later.termination;
    iterations += later.iterations;
    residual = residual > later.residual ? residual : later.residual;
    return *this;
  }
};

/// A solver's answer: the solution and how it was reached. Not converging is an answer, not an exception.
template <class Solution>
struct Solved : Outcome {
  Solution solution;  ///< best iterate; the start after kNumericalFailure

  Solved() = default;
  Solved(Solution value, const Outcome& outcome) : Outcome(outcome), solution(std::move(value)) {}
};

}  // namespace shaped
