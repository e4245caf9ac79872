#include "server/models/folder_watch.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>

#include "core/io/file_error.h"

namespace shaped::server {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kOfFolder = IN_CREATE | IN_MOVED_TO | IN_MOVED_FROM | IN_DELETE | IN_ONLYDIR;
constexpr std::uint32_t kOfSubfolder = IN_MOVED_TO | IN_MOVED_FROM | IN_DELETE | IN_ONLYDIR;

bool hidden(const std::string& name) { return name.empty() || name.front() == '.'; }

std::string reason(int error) {
  const std::string text = std::generic_category().message(error);
  return error == ENOSPC || error == EMFILE ? text + "; raise fs.inotify.max_user_watches or max_user_instances" : text;
}

}  // namespace

FolderWatch::FolderWatch(fs::path folder, Listener listener)
    : folder_(std::move(folder)), listener_(std::move(listener)) {
  events_ = ::inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
  if (events_ >= 0) folder_watch_ = ::inotify_add_watch(events_, folder_.c_str(), kOfFolder);
  if (folder_watch_ >= 0) stop_ = ::eventfd(0, EFD_CLOEXEC);
  if (stop_ < 0) {
    const int error = errno;
    if (events_ >= 0) ::close(events_);
    throw FileError(folder_.string(), "cannot be watched: " + reason(error));
  }
  thread_ = std::thread([this] { serve(); });
}

FolderWatch::~FolderWatch() {
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(stop_, &one, sizeof one);
  thread_.join();
  ::close(stop_);
  ::close(events_);
}

void FolderWatch::serve() {
  reportAll();  // what came between the caller's first look and the watch
  while (true) {
    std::array<pollfd, 2> waiting{{{events_, POLLIN, 0}, {stop_, POLLIN, 0}}};
    if (::poll(waiting.data(), waiting.size(), -1) < 0 && errno != EINTR) return listener_.trouble(reason(errno));
    if (waiting[1].revents != 0) return;
    std::set<std::string> changed;
    readEvents(changed);
    if (overflowed_) {
      overflowed_ = false;
      listener_.trouble("more changed than the kernel's queue holds: looking at everything");
      reportAll();
      continue;
    }
    for (const auto& name : changed) listener_.changed(name);
  }
}

/// Those that are there, and those that were.
void FolderWatch::reportAll() {
  std::set<std::string> names;
  for (const auto& [watch, name] : names_) names.insert(name);
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder_, none)) {
    const auto name = entry.path().filename().string();
    if (hidden(name) || !entry.is_directory(none)) continue;
    watchSubfolder(name);
    names.insert(name);
  }
  for (const auto& name : names) listener_.changed(name);
}

void FolderWatch::readEvents(std::set<std::string>& changed) {
  alignas(inotify_event) std::array<char, 1 << 16> buffer;
  ssize_t size = 0;
  while ((size = ::read(events_, buffer.data(), buffer.size())) > 0) {
    for (ssize_t at = 0; at < size;) {
      const auto* event = reinterpret_cast<const inotify_event*>(buffer.data() + at);
      at += static_cast<ssize_t>(sizeof(inotify_event) + event->len);
      if (event->mask & IN_Q_OVERFLOW) overflowed_ = true;
      if (event->mask & IN_IGNORED) names_.erase(event->wd);
      const std::string entry = event->len > 0 ? event->name : "";
      if (hidden(entry)) continue;
      if (event->wd != folder_watch_) {
        if (const auto name = names_.find(event->wd); name != names_.end()) changed.insert(name->second);
        continue;
      }
      if (!(event->mask & IN_ISDIR)) continue;
      event->mask&(IN_CREATE | IN_MOVED_TO) ? watchSubfolder(entry) : forgetSubfolder(entry);
      changed.insert(entry);
    }
  }
}

void FolderWatch::watchSubfolder(const std::string& name) {
  const int watch = ::inotify_add_watch(events_, (folder_ / name).c_str(), kOfSubfolder);
  if (watch >= 0)
    names_[watch] = name;
  else if (errno != ENOENT && errno != ENOTDIR)  // it has gone again
    listener_.trouble("\"" + name + "\" cannot be watched: " + reason(errno));
}

/// A folder that was moved away would go on to report under its old name.
void FolderWatch::forgetSubfolder(const std::string& name) {
  for (const auto& [watch, known] : names_)
    if (known == name) {
      ::inotify_rm_watch(events_, watch);
      names_.erase(watch);
      return;
    }
}

}  // namespace shaped::server
