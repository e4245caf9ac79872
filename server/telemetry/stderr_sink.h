#pragma once

#include <spdlog/sinks/base_sink.h>
#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

namespace shaped::server {

/// Writes lines to a descriptor (stderr) on a thread of its own, so that a reader who is stuck holds up nobody: lines
/// wait for him in a queue, whose oldest are dropped when it is full. The queue takes no more memory than what waits in
/// it; spdlog's own asynchronous logger keeps room for all 8192, 3 MB, from the start.
class StderrSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  static constexpr std::size_t kLongestQueue = 8192;

  explicit StderrSink(int descriptor = 2);
  ~StderrSink() override;
  /// Writes what is queued for at most a second, drops the rest, and ends. Once; no line may come afterwards.
  void close();
  /// Lines that were not, or not fully, written.
  std::uint64_t lost() const { return lost_; }

 private:
  using Clock = std::chrono::steady_clock;

  void sink_it_(const spdlog::details::log_msg& message) override;
  void flush_() override {}
  void writeLines();
  bool write(std::string_view bytes);
  /// As ::write, but never waits where the system lets us say so.
  ssize_t writeSome(std::string_view bytes) const;
  bool waitUntilWritable() const;
  bool tooLate() const;

  const int descriptor_;
  const int own_;  ///< another way to the same pipe or terminal, which does not block; -1: there is none
  std::atomic<std::uint64_t> lost_{0};
  std::atomic<Clock::rep> give_up_{Clock::time_point::max().time_since_epoch().count()};
  std::mutex queue_mutex_;
  std::condition_variable queue_changed_;
  std::deque<std::string> queue_;
  bool closing_ = false;
  std::thread writer_;
};

}  // namespace shaped::server
