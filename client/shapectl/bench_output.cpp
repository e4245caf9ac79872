#include "client/shapectl/bench_output.h"

#include <array>
#include <cstdio>
#include <sstream>

#include "client/load/code_name.h"

namespace shaped::shapectl {
namespace {

using client::LatencyHistogram;

struct Quantile {
  const char* name;
  double fraction;
};
constexpr std::array<Quantile, 4> kQuantiles{{{"p50", 0.5}, {"p90", 0.9}, {"p99", 0.99}, {"p99.9", 0.999}}};

double seconds(std::chrono::nanoseconds duration) { return std::chrono::duration<double>(duration).count(); }

nlohmann::json toJson(const LatencyHistogram& times) {
  nlohmann::json document{{"count", times.count()}, {"mean", seconds(times.mean())}, {"max", seconds(times.max())}};
  for (const auto& [name, fraction] : kQuantiles) document[name] = seconds(times.quantile(fraction));
  return document;
}

std::string formatted(const char* format, auto... values) {
  std::array<char, 200> line{};
  std::snprintf(line.data(), line.size(), format, values...);
  return line.data();
}

std::string row(const char* name, const LatencyHistogram& times) {
  auto line = formatted("%-34s", name);
  for (const auto& [unused, fraction] : kQuantiles)
    line += formatted(" %10.3f", 1e3 * seconds(times.quantile(fraction)));
  return line + formatted(" %10.3f\n", 1e3 * seconds(times.max()));
}

std::string table(const client::LoadAccount& account) {
  auto text = formatted("%-34s %10s %10s %10s %10s %10s\n", "[ms]", "p50", "p90", "p99", "p99.9", "max");
  text += row("latency, from when it was due", account.latency());
  text += row("service time, from when it was sent", account.service());
  if (account.refusals().count() > 0) text += row("refusals, from when they were sent", account.refusals());
  return text + row("sent late by", account.delay());
}

std::uint64_t refused(const client::LoadAccount& account) { return account.refusals().count(); }

}  // namespace

nlohmann::json toJson(const client::LoadAccount& account) {
  auto errors = nlohmann::json::array();
  for (const auto& [cause, count] : account.errors())
    errors.push_back({{"code", client::codeName(cause.first)}, {"reason", cause.second}, {"count", count}});
  return {{"seconds", account.seconds()},
          {"sent", account.sent()},
          {"unsent", account.unsent()},
          {"late", account.late()},
          {"answered", account.answered()},
          {"good", account.good()},
          {"refused", refused(account)},
          {"answers_per_second", account.answersPerSecond()},
          {"good_per_second", account.goodPerSecond()},
          {"sent_bytes_per_second", account.sentBytesPerSecond()},
          {"received_bytes_per_second", account.receivedBytesPerSecond()},
          {"latency", toJson(account.latency())},
          {"service", toJson(account.service())},
          {"refusals", toJson(account.refusals())},
          {"delay", toJson(account.delay())},
          {"errors", errors}};
}

std::string benchText(const client::LoadAccount& account) {
  std::ostringstream text;
  text << account.sent() << " calls in " << formatted("%.2f", account.seconds()) << " s: " << account.answered()
       << " answered, " << account.good() << " of them in time, " << account.errors().size() << " kinds of errors\n"
       << formatted("%.1f answers/s, %.1f in time/s, %.3f MB/s sent, %.3f MB/s received\n", account.answersPerSecond(),
                    account.goodPerSecond(), 1e-6 * account.sentBytesPerSecond(),
                    1e-6 * account.receivedBytesPerSecond())
       << table(account);
  for (const auto& [cause, count] : account.errors())
    text << count << " x " << client::codeName(cause.first) << (cause.second.empty() ? "" : " ") << cause.second
         << "\n";
  if (account.late() > 0)
    text << account.late() << " calls were sent more than 1 ms late; their latency counts from when they were due\n";
  if (account.unsent() > 0)
    text << account.unsent()
         << " calls that were due found no place until the end and are in no row above: the daemon is "
         << "too slow for this rate, or --concurrency too small\n";
  return text.str();
}

}  // namespace shaped::shapectl
