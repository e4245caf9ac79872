#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <thread>

namespace shaped::server {

/// Tells, by inotify, in which of a folder's subfolders something was renamed into place or has gone. What is merely
/// created in a subfolder does not count: it may be half-written. Names that begin with a dot are left out.
///
/// A report is a hint to look at a subfolder, not a history: several changes may come as one, and every subfolder is
/// reported at the start and when the kernel's queue has overflowed.
class FolderWatch {
 public:
  struct Listener {
    std::function<void(const std::string& name)> changed;  ///< a subfolder, perhaps one that is gone
    std::function<void(const std::string& text)> trouble;  ///< the queue overflowed; a subfolder cannot be watched
  };

  /// The listener is called on the watch's own thread, and must not throw. Throws FileError when the kernel allows no
  /// watch.
  FolderWatch(std::filesystem::path folder, Listener listener);
  ~FolderWatch();
  FolderWatch(const FolderWatch&) = delete;
  FolderWatch& operator=(const FolderWatch&) = delete;

 private:
  void serve();
  void reportAll();
  void readEvents(std::set<std::string>& changed);
  void watchSubfolder(const std::string& name);
  void forgetSubfolder(const std::string& name);

  const std::filesystem::path folder_;
  const Listener listener_;
  int events_ = -1, stop_ = -1, folder_watch_ = -1;
  std::map<int, std::string> names_;  ///< of subfolders, by watch; only the thread's
  bool overflowed_ = false;
  std::thread thread_;
};

}  // namespace shaped::server
