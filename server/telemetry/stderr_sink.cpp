#include "server/telemetry/stderr_sink.h"

#include <fcntl.h>
#include <limits.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <string>
#include <thread>

namespace shaped::server {
namespace {

/// Not blocking is a property of the open file, which others who write to our stderr share: hence a second opening.
/// Fails without /proc, or where the pipe is another user's.
int openWithoutBlocking(int descriptor) {
  struct stat status {};
  if (fstat(descriptor, &status) != 0 || !(S_ISFIFO(status.st_mode) || S_ISCHR(status.st_mode))) return -1;
  const auto path = "/proc/self/fd/" + std::to_string(descriptor);
  return open(path.c_str(), O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
}

}  // namespace

StderrSink::StderrSink(int descriptor)
    : descriptor_(descriptor), own_(openWithoutBlocking(descriptor)), writer_([this] { writeLines(); }) {}

StderrSink::~StderrSink() {
  close();
  if (own_ >= 0) ::close(own_);
}

void StderrSink::close() {
  if (!writer_.joinable()) return;
  give_up_ = (Clock::now() + std::chrono::seconds(1)).time_since_epoch().count();
  {
    const std::scoped_lock lock(queue_mutex_);
    closing_ = true;
  }
  queue_changed_.notify_one();
  writer_.join();
}

void StderrSink::sink_it_(const spdlog::details::log_msg& message) {
  spdlog::memory_buf_t line;
  formatter_->format(message, line);
  {
    const std::scoped_lock lock(queue_mutex_);
    if (queue_.size() == kLongestQueue) {
      queue_.pop_front();
      ++lost_;
    }
    queue_.emplace_back(line.data(), line.size());
  }
  queue_changed_.notify_one();
}

void StderrSink::writeLines() {
  std::unique_lock lock(queue_mutex_);
  while (true) {
    queue_changed_.wait(lock, [this] { return closing_ || !queue_.empty(); });
    if (queue_.empty()) return;
    const auto line = std::move(queue_.front());
    queue_.pop_front();
    lock.unlock();
    if (!write(line)) ++lost_;
    lock.lock();
  }
}

bool StderrSink::write(std::string_view bytes) {
  while (!bytes.empty()) {
    if (!waitUntilWritable()) return false;
    const auto written = writeSome(bytes);
    if (written < 0 && errno != EINTR && errno != EAGAIN) return false;
    // Some systems call a pipe writable that has not the room for a piece.
    if (written < 0 && errno == EAGAIN) {
      if (tooLate()) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    if (written > 0) bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

ssize_t StderrSink::writeSome(std::string_view bytes) const {
  // On Linux a pipe that is writable at all takes PIPE_BUF bytes at once; more would block where there is no other way.
  const auto count = std::min<std::size_t>(bytes.size(), PIPE_BUF);
  if (own_ >= 0) return ::write(own_, bytes.data(), count);
  const auto sent = send(descriptor_, bytes.data(), count, MSG_DONTWAIT | MSG_NOSIGNAL);
  return sent < 0 && errno == ENOTSOCK ? ::write(descriptor_, bytes.data(), count) : sent;
}

bool StderrSink::tooLate() const { return Clock::now().time_since_epoch().count() >= give_up_; }

bool StderrSink::waitUntilWritable() const {
  constexpr int slice = 100;  // [ms], so that close() is soon seen
  while (true) {
    const bool too_late = tooLate();
    pollfd wanted{descriptor_, POLLOUT, 0};
    const int ready = poll(&wanted, 1, too_late ? 0 : slice);
    if (ready > 0) return true;
    if (too_late || (ready < 0 && errno != EINTR)) return false;
  }
}

}  // namespace shaped::server
