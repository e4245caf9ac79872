#pragma once

#include "core/numerics/solved.h"
#include "shaped/v1/report.pb.h"

namespace shaped::server {

v1::Termination toProto(Termination termination);
/// Of what toProto() made; anything else counts as a numerical failure.
Termination terminationFromProto(v1::Termination termination);
/// seconds: wall-clock time of the work.
void toProto(const Outcome& outcome, double seconds, v1::SolverReport& report);

}  // namespace shaped::server
