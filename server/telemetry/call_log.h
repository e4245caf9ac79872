#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "trace/trace_context.h"

namespace shaped::server {

/// One call that has ended, for the log.
struct CallRecord {
  std::uint64_t request_id = 0;
  std::string method;          ///< "Shapes.Project"
  std::string client;          ///< name of the token or certificate; empty where nobody was asked
  std::string model;           ///< "NAME@VERSION"; empty where no model took part
  std::string outcome;         ///< gRPC status name
  std::string message;         ///< of a status that is not OK
  double seconds = 0;          ///< from arrival to answer
  double queue_seconds = 0;    ///< of these, waiting for a worker
  double compute_seconds = 0;  ///< of these, a worker's time
  std::string peer;            ///< "ipv4:127.0.0.1:53012"
  TraceContext trace;          ///< the call's own span
  std::string parent_id;       ///< the caller's span; empty when the trace begins here
};

enum class Severity { kInfo, kWarning, kError };

/// Throws InvalidInput naming `where` unless the level is debug, info, warn or error.
void requireLogLevel(const std::string& level, const std::string& where);
/// Throws InvalidInput naming `where` unless the format is text or json.
void requireLogFormat(const std::string& format, const std::string& where);

/// Starts the process's log on stderr. level: debug, info, warn, error; format: text, json. Throws InvalidInput naming
/// --log or --log-format for others. May be called again; before the first call nothing is logged.
///
/// Lines go through a queue of 8192 to a thread of the log's own, which drops the oldest when it is full: whoever reads
/// stderr slowly, or not at all, loses lines but never holds up a worker, and finds the latest ones when he returns.
void startLog(const std::string& level, const std::string& format = "text");
/// Changes the level, at any time, from any thread. Throws as requireLogLevel().
void setLogLevel(const std::string& level);
/// Writes what is queued; gives up after a second when nobody takes it.
void stopLog();
/// Lines that were dropped since the process began.
std::uint64_t lostLogLines();

/// Writes the record as one line: info when OK, warn for what the client did, error for what the server did.
void logCall(const CallRecord& record, bool servers_fault);

/// Writes one line about a call that was turned away before it became one. client: as in CallRecord.
void logRefusal(const std::string& method, const std::string& client, const std::string& reason);

/// One line about the daemon itself.
void logInfo(const std::string& line);
void logWarning(const std::string& line);
void logError(const std::string& line);

// What a line looks like. Everything that clients can choose is escaped as in JSON, down to ASCII, so that it can forge
// neither lines nor fields nor control a terminal.

/// "request=7 method=Models.List ... message="no such ..."", without time and level.
std::string textLine(const CallRecord& record);
/// {"time": ..., "level": ..., "request": 7, ...}; the time in UTC with milliseconds, as RFC 3339 writes it.
std::string jsonLine(const CallRecord& record, Severity severity, std::chrono::system_clock::time_point now);
/// A line about the daemon.
std::string jsonLine(const std::string& message, Severity severity, std::chrono::system_clock::time_point now);

}  // namespace shaped::server
