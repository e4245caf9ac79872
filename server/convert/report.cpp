#include "server/convert/report.h"

namespace shaped::server {

v1::Termination toProto(Termination termination) {
  switch (termination) {
    case Termination::kConverged:
      return v1::TERMINATION_CONVERGED;
    case Termination::kIterationLimit:
      return v1::TERMINATION_ITERATION_LIMIT;
    case Termination::kStalled:
      return v1::TERMINATION_STALLED;
    case Termination::kCancelled:
      return v1::TERMINATION_CANCELLED;
    case Termination::kNumericalFailure:
      return v1::TERMINATION_NUMERICAL_FAILURE;
  }
  return v1::TERMINATION_UNSPECIFIED;
}

Termination terminationFromProto(v1::Termination termination) {
  for (const auto one : {Termination::kConverged, Termination::kIterationLimit, Termination::kStalled,
                         Termination::kCancelled})
    if (toProto(one) == termination) return one;
  return Termination::kNumericalFailure;
}

void toProto(const Outcome& outcome, double seconds, v1::SolverReport& report) {
  report.set_termination(toProto(outcome.termination));
  report.set_iterations(outcome.iterations);
  report.set_residual(outcome.residual);
  report.set_seconds(seconds);
}

}  // namespace shaped::server
