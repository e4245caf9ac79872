#pragma once

namespace shaped::shapectl {

/// What shapectl returns to the shell; documented in docs/api.md and `shapectl --help`.
enum class ExitCode {
  kSuccess = 0,
  kInternal = 1,      ///< a defect, or this machine failed (disk full, missing permission)
  kBadInput = 2,      ///< the command line, a file or the request: change it
  kNotFound = 3,      ///< no such model, dataset or job
  kUnavailable = 4,   ///< the daemon cannot be reached or is busy: try again later
  kDeadline = 5,      ///< --timeout or the daemon's limit passed
  kCancelled = 6,     ///< Ctrl-C, or a job was cancelled
  kNotConverged = 7,  ///< there is an answer and it was written, but its solver did not converge
  kDenied = 8,        ///< no token or certificate that the daemon knows, or one without the role
};

}  // namespace shaped::shapectl
