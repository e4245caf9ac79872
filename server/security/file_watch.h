#pragma once

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace shaped::server {

/// Looks at files every so often and tells when one of them is another than before: its inode, size or time of change.
/// Links are followed, so that a link that is turned to another file (as orchestrators do it) counts. Polling and not
/// inotify: that sees neither such links' targets nor network file systems.
class FileWatch {
 public:
  /// changed: called on the watch's own thread, and must not throw.
  FileWatch(std::vector<std::filesystem::path> files, std::chrono::milliseconds period, std::function<void()> changed);
  ~FileWatch();
  FileWatch(const FileWatch&) = delete;
  FileWatch& operator=(const FileWatch&) = delete;

 private:
  void watch();

  const std::vector<std::filesystem::path> files_;
  const std::chrono::milliseconds period_;
  const std::function<void()> changed_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stopping_ = false;
  std::vector<long long> seen_;
  std::thread thread_;
};

}  // namespace shaped::server
