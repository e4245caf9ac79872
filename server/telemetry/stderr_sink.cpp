#include "server/telemetry/stderr_sink.h"

#include <limits.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

namespace shaped::server {

void StderrSink::close() { give_up_ = (Clock::now() + std::chrono::seconds(1)).time_since_epoch().count(); }

void StderrSink::sink_it_(const spdlog::details::log_msg& message) {
  spdlog::memory_buf_t line;
  formatter_->format(message, line);
  if (!write({line.data(), line.size()})) ++lost_;
}

bool StderrSink::write(std::string_view bytes) {
  while (!bytes.empty()) {
    if (!waitUntilWritable()) return false;
    // A pipe that is writable at all takes PIPE_BUF bytes at once; more would block.
    const auto written = ::write(descriptor_, bytes.data(), std::min<std::size_t>(bytes.size(), PIPE_BUF));
    if (written < 0 && errno != EINTR && errno != EAGAIN) return false;
    if (written > 0) bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

bool StderrSink::waitUntilWritable() const {
  constexpr int slice = 100;  // [ms], so that close() is soon seen
  while (true) {
    const bool too_late = Clock::now().time_since_epoch().count() >= give_up_;
    pollfd wanted{descriptor_, POLLOUT, 0};
    const int ready = poll(&wanted, 1, too_late ? 0 : slice);
    if (ready > 0) return true;
    if (too_late || (ready < 0 && errno != EINTR)) return false;
  }
}

}  // namespace shaped::server
