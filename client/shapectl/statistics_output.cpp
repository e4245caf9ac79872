#include "client/shapectl/statistics_output.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "client/shapectl/output.h"

namespace shaped::shapectl {
namespace {

using Statistics = v1::GetStatisticsResponse;

nlohmann::json toJson(const v1::DurationStatistics& duration) {
  return {{"count", duration.count()}, {"seconds", duration.seconds()}, {"recent_count", duration.recent_count()},
          {"p50", duration.p50()},     {"p90", duration.p90()},         {"p99", duration.p99()}};
}

nlohmann::json toJson(const v1::MethodStatistics& method) {
  auto codes = nlohmann::json::object();
  for (const auto& entry : method.by_code()) codes[entry.code()] = entry.count();
  nlohmann::json document{{"method", method.method()},       {"by_code", codes},
                          {"in_flight", method.in_flight()}, {"request", toJson(method.request())},
                          {"queue", toJson(method.queue())}, {"compute", toJson(method.compute())}};
  if (!method.has_solver()) return document;
  auto unconverged = nlohmann::json::object();
  for (const auto& entry : method.solver().unconverged()) unconverged[nameOf(entry.termination())] = entry.count();
  document["solver"] = {
      {"solves", method.solver().solves()}, {"iterations", method.solver().iterations()}, {"unconverged", unconverged}};
  return document;
}

nlohmann::json toJson(const v1::PoolStatistics& pool) {
  return {{"pool", pool.pool()},
          {"threads", pool.threads()},
          {"busy_threads", pool.busy_threads()},
          {"queue_length", pool.queue_length()},
          {"queue_length_limit", pool.queue_length_limit()},
          {"bytes_in_flight", pool.bytes_in_flight()},
          {"bytes_in_flight_limit", pool.bytes_in_flight_limit()},
          {"open_streams", pool.open_streams()},
          {"open_streams_limit", pool.open_streams_limit()}};
}

nlohmann::json toJson(const v1::ProcessStatistics& process) {
  return {{"resident_bytes", process.resident_bytes()},
          {"memory_limit_bytes", process.memory_limit_bytes()},
          {"cpu_seconds", process.cpu_seconds()},
          {"open_files", process.open_files()},
          {"threads", process.threads()}};
}

template <class... Values>
std::string format(const char* pattern, Values... values) {
  std::array<char, 512> line;
  std::snprintf(line.data(), line.size(), pattern, values...);
  return line.data();
}

/// "812 us", "3.4 ms", "12.1 s"; "-" for 0.
std::string duration(double seconds) {
  if (seconds <= 0) return "-";
  if (seconds < 1e-3) return format("%.0f us", 1e6 * seconds);
  return seconds < 1 ? format("%.3g ms", 1e3 * seconds) : format("%.3g s", seconds);
}

std::string bytes(std::uint64_t count) {
  constexpr double kibi = 1024;
  const auto value = static_cast<double>(count);
  if (value < kibi * kibi) return format("%.0f KiB", value / kibi);
  return value < kibi * kibi * kibi ? format("%.1f MiB", value / kibi / kibi)
                                    : format("%.1f GiB", value / kibi / kibi / kibi);
}

std::string uptime(double seconds) {
  const auto whole = static_cast<long>(seconds);
  if (whole < 60) return format("%ld s", whole);
  if (whole < 3600) return format("%ld min %02ld s", whole / 60, whole % 60);
  return whole < 86400 ? format("%ld h %02ld min", whole / 3600, whole / 60 % 60)
                       : format("%ld d %02ld h", whole / 86400, whole / 3600 % 24);
}

const v1::MethodStatistics* find(const Statistics& statistics, const std::string& method) {
  const auto& methods = statistics.methods();
  const auto found =
      std::find_if(methods.begin(), methods.end(), [&](const auto& each) { return each.method() == method; });
  return found == methods.end() ? nullptr : &*found;
}

/// Calls a second. A daemon that was restarted between the snapshots has counted anew: then over the last minute.
double rate(const v1::MethodStatistics& method, const Statistics& now, const Statistics* before) {
  constexpr double window = 60;
  const auto* earlier = before ? find(*before, method.method()) : nullptr;
  if (!earlier || now.uptime() <= before->uptime() || earlier->request().count() > method.request().count())
    return static_cast<double>(method.request().recent_count()) / std::clamp(now.uptime(), 1.0, window);
  return static_cast<double>(method.request().count() - earlier->request().count()) / (now.uptime() - before->uptime());
}

/// Processors in use, in per cent of one.
double cpuPercent(const Statistics& now, const Statistics* before) {
  const bool comparable = before && now.uptime() > before->uptime();
  const double seconds = now.process().cpu_seconds() - (comparable ? before->process().cpu_seconds() : 0);
  return 100 * seconds / std::max(now.uptime() - (comparable ? before->uptime() : 0), 1e-3);
}

std::string headLine(const Statistics& now, const Statistics* before, const std::string& server) {
  const auto& process = now.process();
  return "shaped " + now.version() + " at " + server + ", up " + uptime(now.uptime()) + ", memory " +
         bytes(process.resident_bytes()) + " of " + bytes(process.memory_limit_bytes()) +
         format(", cpu %.0f %%, %lu threads, %lu files", cpuPercent(now, before),
                static_cast<unsigned long>(process.threads()), static_cast<unsigned long>(process.open_files()));
}

std::string poolLine(const v1::PoolStatistics& pool) {
  return format("%-9s%u of %u busy, %lu of %lu waiting, ", pool.pool().c_str(), pool.busy_threads(), pool.threads(),
                static_cast<unsigned long>(pool.queue_length()),
                static_cast<unsigned long>(pool.queue_length_limit())) +
         bytes(pool.bytes_in_flight()) + " of " + bytes(pool.bytes_in_flight_limit()) +
         format(" in flight, %lu of %lu streams", static_cast<unsigned long>(pool.open_streams()),
                static_cast<unsigned long>(pool.open_streams_limit()));
}

/// "queued 1, running 2", without what is 0.
template <class Entries, class Name>
std::string countsText(const Entries& entries, const Name& name) {
  std::string text;
  for (const auto& entry : entries)
    if (entry.count() > 0) text += (text.empty() ? "" : ", ") + name(entry) + " " + std::to_string(entry.count());
  return text.empty() ? "none" : text;
}

std::string modelsLine(const Statistics& now) {
  std::uint64_t sum = 0;
  std::string names;
  for (const auto& model : now.models()) {
    sum += model.bytes();
    names += ", " + modelText(model.model()) + " " + bytes(model.bytes());
  }
  return format("%-9s%d in memory", "models", now.models_size()) + (sum > 0 ? ", " + bytes(sum) : "") + names;
}

std::string methodHead() {
  return format("%-22s%8s%9s%9s%8s%10s%10s%10s%10s%10s%7s%8s", "METHOD", "FLYING", "CALLS/S", "CALLS", "NOT OK", "P50",
                "P90", "P99", "QUEUE", "COMPUTE", "ITER", "UNCONV");
}

std::string methodLine(const v1::MethodStatistics& method, double calls_per_second) {
  std::uint64_t failed = 0, unconverged = 0;
  for (const auto& entry : method.by_code()) failed += entry.code() == "OK" ? 0 : entry.count();
  for (const auto& entry : method.solver().unconverged()) unconverged += entry.count();
  const auto solves = method.solver().solves();
  const auto iterations =
      solves > 0 ? format("%.1f", static_cast<double>(method.solver().iterations()) / static_cast<double>(solves))
                 : "-";
  const auto shortfalls = solves > 0 ? std::to_string(unconverged) : "-";
  return format("%-22s%8ld%9.1f%9lu%8lu%10s%10s%10s%10s%10s%7s%8s", method.method().c_str(),
                static_cast<long>(method.in_flight()), calls_per_second,
                static_cast<unsigned long>(method.request().count()), static_cast<unsigned long>(failed),
                duration(method.request().p50()).c_str(), duration(method.request().p90()).c_str(),
                duration(method.request().p99()).c_str(), duration(method.queue().p50()).c_str(),
                duration(method.compute().p50()).c_str(), iterations.c_str(), shortfalls.c_str());
}

}  // namespace

nlohmann::json toJson(const Statistics& statistics) {
  nlohmann::json document{{"version", statistics.version()},
                          {"started", timeText(statistics.started())},
                          {"uptime", statistics.uptime()},
                          {"process", toJson(statistics.process())},
                          {"lost_log_lines", statistics.lost_log_lines()},
                          {"methods", nlohmann::json::array()},
                          {"pools", nlohmann::json::array()},
                          {"models", nlohmann::json::array()},
                          {"refusals", nlohmann::json::object()},
                          {"denials", nlohmann::json::object()},
                          {"jobs", nlohmann::json::object()}};
  for (const auto& method : statistics.methods()) document["methods"].push_back(toJson(method));
  for (const auto& pool : statistics.pools()) document["pools"].push_back(toJson(pool));
  for (const auto& model : statistics.models()) {
    nlohmann::json entry{{"bytes", model.bytes()}};
    addModel(entry, model.model());
    document["models"].push_back(entry);
  }
  for (const auto& refusal : statistics.refusals()) document["refusals"][refusal.cause()] = refusal.count();
  for (const auto& denial : statistics.denials()) document["denials"][denial.code()] = denial.count();
  for (const auto& job : statistics.jobs()) document["jobs"][job.state()] = job.count();
  return document;
}

std::vector<std::string> screenOf(const Statistics& now, const Statistics* before, const std::string& server) {
  std::vector<std::string> lines{headLine(now, before, server)};
  for (const auto& pool : now.pools()) lines.push_back(poolLine(pool));
  lines.push_back("refusals " + countsText(now.refusals(), [](const auto& entry) { return entry.cause(); }));
  if (std::any_of(now.denials().begin(), now.denials().end(), [](const auto& entry) { return entry.count() > 0; }))
    lines.push_back("denials  " + countsText(now.denials(), [](const auto& entry) { return entry.code(); }));
  lines.push_back("jobs     " + countsText(now.jobs(), [](const auto& entry) { return entry.state(); }));
  lines.push_back(modelsLine(now));
  if (now.lost_log_lines() > 0) lines.push_back("log      " + std::to_string(now.lost_log_lines()) + " lines lost");
  lines.push_back("");
  lines.push_back(methodHead());
  for (const auto& method : now.methods())
    if (method.request().count() > 0 || method.in_flight() > 0)
      lines.push_back(methodLine(method, rate(method, now, before)));
  return lines;
}

}  // namespace shaped::shapectl
