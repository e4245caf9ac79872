#pragma once

#include <functional>

#include "client/shapectl/exit_code.h"
#include "client/shapectl/session.h"

namespace shaped::shapectl {

/// Which exit code a gRPC status stands for.
ExitCode exitCodeOf(grpc::StatusCode code);

/// Runs a verb; an exception becomes a message and an exit code. A failure after Ctrl-C counts as cancelled.
ExitCode reportingFailures(const Session& session, const std::function<ExitCode()>& verb);

}  // namespace shaped::shapectl
