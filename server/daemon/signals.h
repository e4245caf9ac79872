#pragma once

#include <chrono>

namespace shaped::server {

/// What the operator asks of the process.
enum class Signal { kStop, kReload };

/// From here on SIGINT and SIGTERM ask to stop, SIGHUP to read the configuration again; a file over the size limit is
/// an error to report instead of the process's end. Once, early in main().
void catchSignals();

/// Waits for the next signal.
Signal waitForSignal();

/// Waits for a signal to stop; false when none came in time. A signal to reload that comes meanwhile is lost.
bool stopSignalWithin(std::chrono::duration<double> time);

}  // namespace shaped::server
