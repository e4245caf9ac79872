#pragma once

#include <spdlog/details/null_mutex.h>
#include <spdlog/sinks/base_sink.h>
#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <string_view>

namespace shaped::server {

/// Writes lines to a descriptor (stderr), for one thread. Waits while its reader is stuck, so that lines queue up
/// before it; once closed it waits a second in all, then drops them.
class StderrSink final : public spdlog::sinks::base_sink<spdlog::details::null_mutex> {
 public:
  explicit StderrSink(int descriptor = 2);
  ~StderrSink() override;
  /// From any thread.
  void close();
  /// Lines that were not, or not fully, written.
  std::uint64_t lost() const { return lost_; }

 private:
  using Clock = std::chrono::steady_clock;

  void sink_it_(const spdlog::details::log_msg& message) override;
  void flush_() override {}
  bool write(std::string_view bytes);
  /// As ::write, but never waits where the system lets us say so.
  ssize_t writeSome(std::string_view bytes) const;
  bool waitUntilWritable() const;
  bool tooLate() const;

  const int descriptor_;
  const int own_;  ///< another way to the same pipe or terminal, which does not block; -1: there is none
  std::atomic<std::uint64_t> lost_{0};
  std::atomic<Clock::rep> give_up_{Clock::time_point::max().time_since_epoch().count()};
};

}  // namespace shaped::server
