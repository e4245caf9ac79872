#pragma once

#include <cstdint>
#include <string>

namespace shaped::server {

/// One call that has ended, for the log.
struct CallRecord {
  std::uint64_t request_id = 0;
  std::string method;   ///< "Shapes.Project"
  std::string client;   ///< name of the token or certificate; empty where nobody was asked
  std::string model;    ///< "NAME@VERSION"; empty where no model took part
  std::string outcome;  ///< gRPC status name
  std::string message;  ///< of a status that is not OK
  double seconds = 0;   ///< from arrival to answer
};

/// Throws InvalidInput naming `where` unless the level is debug, info, warn or error.
void requireLogLevel(const std::string& level, const std::string& where);

/// Sets level and pattern of the process's log on stderr, before other threads write to it. Throws as
/// requireLogLevel().
void startLog(const std::string& level);
/// Changes the level, at any time, from any thread. Throws as requireLogLevel().
void setLogLevel(const std::string& level);

/// Writes the record as one line: info when OK, warn for what the client did, error for what the server did.
void logCall(const CallRecord& record, bool servers_fault);

/// Writes one line about a call that was turned away before it became one. client: as in CallRecord.
void logRefusal(const std::string& method, const std::string& client, const std::string& reason);

/// One line about the daemon itself.
void logInfo(const std::string& line);
void logWarning(const std::string& line);
void logError(const std::string& line);

}  // namespace shaped::server
