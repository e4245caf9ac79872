#include "trace/trace_context.h"

#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>

namespace shaped {
namespace {

constexpr std::size_t kTraceDigits = 32, kSpanDigits = 16;
constexpr std::string_view kDigits = "0123456789abcdef";

bool isId(std::string_view text) {
  return text.find_first_not_of(kDigits) == text.npos && text.find_first_not_of('0') != text.npos;
}

/// Random digits, not all 0. From the system, not from a generator of ours: ids must differ between machines and forks.
std::string randomId(std::size_t digits) {
  std::string id;
  do {
    std::array<std::uint8_t, kTraceDigits> bytes;
    if (getrandom(bytes.data(), digits, 0) != static_cast<ssize_t>(digits)) {
      std::random_device device;  // throws where the system has no randomness at all
      for (auto& byte : bytes) byte = static_cast<std::uint8_t>(device());
    }
    id.clear();
    for (std::size_t i = 0; i < digits; ++i) id += kDigits[bytes[i] % 16];
  } while (!isId(id));
  return id;
}

}  // namespace

std::string TraceContext::header() const { return "00-" + trace_id + "-" + span_id + (sampled ? "-01" : "-00"); }

TraceContext TraceContext::child() const { return {trace_id, randomId(kSpanDigits), sampled}; }

std::optional<TraceContext> parseTraceparent(std::string_view header) {
  constexpr std::size_t span_at = 3 + kTraceDigits + 1, flags_at = span_at + kSpanDigits + 1;
  if (header.size() != flags_at + 2 || !header.starts_with("00-")) return std::nullopt;
  if (header[span_at - 1] != '-' || header[flags_at - 1] != '-') return std::nullopt;
  const auto trace = header.substr(3, kTraceDigits), span = header.substr(span_at, kSpanDigits);
  const auto flags = header.substr(flags_at);
  if (!isId(trace) || !isId(span) || flags.find_first_not_of(kDigits) != flags.npos) return std::nullopt;
  const bool sampled = kDigits.find(flags[1]) % 2 == 1;  // the other bits have no meaning in version 00
  return TraceContext{std::string(trace), std::string(span), sampled};
}

TraceContext newTrace() { return {randomId(kTraceDigits), randomId(kSpanDigits), false}; }

}  // namespace shaped
