#include "server/telemetry/call_log.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <spdlog/logger.h>

#include <atomic>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>

#include "core/numerics/error.h"
#include "server/telemetry/stderr_sink.h"

namespace shaped::server {
namespace {

using Time = std::chrono::system_clock::time_point;
using Document = nlohmann::ordered_json;

/// On one line, in ASCII; bytes that are no UTF-8 are replaced.
std::string dump(const Document& document) { return document.dump(-1, ' ', true, Document::error_handler_t::replace); }

std::string quoted(const std::string& text) { return dump(Document(text)); }

/// Escaped, without the quotes.
std::string oneLine(const std::string& text) {
  const auto escaped = quoted(text);
  return escaped.substr(1, escaped.size() - 2);
}

const char* nameOf(Severity severity) {
  switch (severity) {
    case Severity::kInfo:
      return "info";
    case Severity::kWarning:
      return "warning";
    case Severity::kError:
      return "error";
  }
  return "error";
}

spdlog::level::level_enum levelOf(Severity severity) {
  switch (severity) {
    case Severity::kInfo:
      return spdlog::level::info;
    case Severity::kWarning:
      return spdlog::level::warn;
    case Severity::kError:
      return spdlog::level::err;
  }
  return spdlog::level::err;
}

std::string timeText(Time time) {
  const auto milliseconds =
      std::chrono::duration_cast<std::chrono::milliseconds>(time.time_since_epoch()).count() % 1000;
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z", fmt::gmtime(std::chrono::system_clock::to_time_t(time)),
                     milliseconds);
}

Document head(Severity severity, Time now) { return {{"time", timeText(now)}, {"level", nameOf(severity)}}; }

/// Six digits are microseconds; more would only lengthen the line.
double rounded(double seconds) { return std::round(1e6 * seconds) / 1e6; }

std::atomic<std::uint64_t> lost_before{0};  // by logs that have been replaced

/// The process's log.
struct Log {
  Log(spdlog::level::level_enum level, bool as_json) : json(as_json) {
    logger.set_level(level);
    logger.set_pattern(json ? "%v" : "%Y-%m-%dT%H:%M:%S.%e%z %l %v");
  }
  ~Log() {
    sink->close();
    lost_before += sink->lost();
  }

  std::uint64_t lost() const { return sink->lost(); }

  bool json;
  std::shared_ptr<StderrSink> sink = std::make_shared<StderrSink>();
  spdlog::logger logger{"shaped", sink};
};

std::mutex mutex;
std::shared_ptr<Log> current;

std::shared_ptr<Log> currentLog() {
  const std::scoped_lock lock(mutex);
  return current;
}

void replaceLog(std::shared_ptr<Log> next) {
  {
    const std::scoped_lock lock(mutex);
    current.swap(next);
  }
  // The one that was ends here, without the lock.
}

void write(const std::string& line, Severity severity) {
  const auto log = currentLog();
  if (!log || !log->logger.should_log(levelOf(severity))) return;
  log->logger.log(levelOf(severity),
                   log->json ? jsonLine(line, severity, std::chrono::system_clock::now()) : oneLine(line));
}

std::string orDash(const std::string& text) { return text.empty() ? "-" : oneLine(text); }

}  // namespace

void requireLogLevel(const std::string& level, const std::string& where) {
  for (const auto* known : {"debug", "info", "warn", "error"})
    if (level == known) return;
  throw InvalidInput(where, "\"" + level + "\" is no level; use debug, info, warn or error");
}

void requireLogFormat(const std::string& format, const std::string& where) {
  if (format != "text" && format != "json")
    throw InvalidInput(where, "\"" + format + "\" is no format; use text or json");
}

void startLog(const std::string& level, const std::string& format) {
  requireLogLevel(level, "--log");
  requireLogFormat(format, "--log-format");
  replaceLog(std::make_shared<Log>(spdlog::level::from_str(level), format == "json"));
}

void setLogLevel(const std::string& level) {
  requireLogLevel(level, "--log");
  if (const auto log = currentLog()) log->logger.set_level(spdlog::level::from_str(level));
}

void stopLog() { replaceLog(nullptr); }

std::uint64_t lostLogLines() {
  const std::scoped_lock lock(mutex);
  return lost_before + (current ? current->lost() : 0);
}

std::string textLine(const CallRecord& record) {
  return fmt::format(
      "request={} method={} client={} model={} outcome={} seconds={:.6f} queue_seconds={:.6f} compute_seconds={:.6f} "
      "peer={} "
      "trace={}{}{}",
      record.request_id, record.method, orDash(record.client), orDash(record.model), record.outcome, record.seconds,
      record.queue_seconds, record.compute_seconds, oneLine(record.peer), record.trace.trace_id,
      record.message.empty() ? "" : " message=", record.message.empty() ? "" : quoted(record.message));
}

std::string jsonLine(const CallRecord& record, Severity severity, Time now) {
  auto line = head(severity, now);
  line["request"] = record.request_id;
  line["method"] = record.method;
  line["client"] = record.client;
  line["model"] = record.model;
  line["outcome"] = record.outcome;
  line["seconds"] = rounded(record.seconds);
  line["queue_seconds"] = rounded(record.queue_seconds);
  line["compute_seconds"] = rounded(record.compute_seconds);
  line["peer"] = record.peer;
  line["trace_id"] = record.trace.trace_id;
  line["span_id"] = record.trace.span_id;
  line["parent_id"] = record.parent_id;
  line["message"] = record.message;
  return dump(line);
}

std::string jsonLine(const std::string& message, Severity severity, Time now) {
  auto line = head(severity, now);
  line["message"] = message;
  return dump(line);
}

void logCall(const CallRecord& record, bool servers_fault) {
  const auto severity = record.message.empty() ? Severity::kInfo
                        : servers_fault        ? Severity::kError
                                               : Severity::kWarning;
  const auto log = currentLog();
  if (!log || !log->logger.should_log(levelOf(severity))) return;
  log->logger.log(levelOf(severity),
                   log->json ? jsonLine(record, severity, std::chrono::system_clock::now()) : textLine(record));
}

void logRefusal(const std::string& method, const std::string& client, const std::string& reason) {
  write("refused method=" + orDash(method) + " client=" + orDash(client) + " message=" + reason, Severity::kWarning);
}

void logInfo(const std::string& line) { write(line, Severity::kInfo); }
void logWarning(const std::string& line) { write(line, Severity::kWarning); }
void logError(const std::string& line) { write(line, Severity::kError); }

}  // namespace shaped::server
