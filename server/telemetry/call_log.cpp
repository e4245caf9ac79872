#include "server/telemetry/call_log.h"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>

#include "core/numerics/error.h"

namespace shaped::server {
namespace {

/// What clients write must not forge log lines.
std::string oneLine(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return std::iscntrl(c) != 0; }, ' ');
  return text;
}

std::string orDash(const std::string& text) { return text.empty() ? "-" : oneLine(text); }

}  // namespace

void requireLogLevel(const std::string& level, const std::string& where) {
  for (const auto* known : {"debug", "info", "warn", "error"})
    if (level == known) return;
  throw InvalidInput(where, "\"" + level + "\" is no level; use debug, info, warn or error");
}

void startLog(const std::string& level) {
  spdlog::drop("shaped");
  auto logger = spdlog::stderr_logger_mt("shaped");
  logger->set_pattern("%Y-%m-%dT%H:%M:%S.%e%z %l %v");
  logger->flush_on(spdlog::level::info);
  spdlog::set_default_logger(std::move(logger));
  setLogLevel(level);
}

void setLogLevel(const std::string& level) {
  requireLogLevel(level, "--log");
  spdlog::default_logger()->set_level(spdlog::level::from_str(level));
}

void logCall(const CallRecord& record, bool servers_fault) {
  const auto level = record.message.empty() ? spdlog::level::info
                     : servers_fault        ? spdlog::level::err
                                            : spdlog::level::warn;
  spdlog::log(level, "request={} method={} client={} model={} outcome={} seconds={:.6f}{}{}", record.request_id,
              record.method, orDash(record.client), orDash(record.model), record.outcome, record.seconds,
              record.message.empty() ? "" : " message=", oneLine(record.message));
}

void logRefusal(const std::string& method, const std::string& client, const std::string& reason) {
  spdlog::warn("refused method={} client={} message={}", orDash(method), orDash(client), oneLine(reason));
}

void logInfo(const std::string& line) { spdlog::info(oneLine(line)); }
void logWarning(const std::string& line) { spdlog::warn(oneLine(line)); }
void logError(const std::string& line) { spdlog::error(oneLine(line)); }

}  // namespace shaped::server
