#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace shaped {

/// Where a call stands in a distributed trace: what the header "traceparent" of W3C Trace Context says.
struct TraceContext {
  std::string trace_id;  ///< 32 lower-case hexadecimal digits, not all 0
  std::string span_id;   ///< 16 of them, not all 0: the caller's, who is the parent of whatever is called
  bool sampled = false;  ///< the caller may have recorded it

  /// "00-TRACE-SPAN-FLAGS"
  std::string header() const;
  /// The same trace with a new, random span id: what a call made on behalf of this one carries.
  TraceContext child() const;
};

/// The header's name in gRPC metadata.
inline constexpr const char* kTraceparent = "traceparent";

/// A header of version 00, to the letter: anything else is none.
std::optional<TraceContext> parseTraceparent(std::string_view header);

/// A new trace: random ids, not sampled.
TraceContext newTrace();

}  // namespace shaped
