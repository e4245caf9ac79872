#include "core/io/folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <system_error>

#include "core/io/file_error.h"

namespace shaped {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kScratch = ".scratch-";

[[noreturn]] void fail(const fs::path& path, const std::string& problem, int error) {
  throw FileError(path.string(), problem + ": " + std::generic_category().message(error));
}

int openFolder(const fs::path& folder) { return ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); }

fs::path scratchName(const fs::path& parent) {
  static std::atomic<unsigned> counter{0};
  return parent / (std::string(kScratch) + std::to_string(::getpid()) + "-" + std::to_string(counter++));
}

}  // namespace

void makeFolder(const fs::path& folder) {
  if (::mkdir(folder.c_str(), 0777) == 0) return syncFolder(folder.parent_path());
  const int error = errno;
  std::error_code ignored;
  if (error != EEXIST || !fs::is_directory(folder, ignored)) fail(folder, "cannot be made", error);
}

void syncFolder(const fs::path& folder) {
  const int descriptor = openFolder(folder.empty() ? fs::path(".") : folder);
  if (descriptor < 0) fail(folder, "cannot be opened", errno);
  const int error = ::fsync(descriptor) != 0 ? errno : 0;
  ::close(descriptor);
  if (error != 0 && error != EINVAL) fail(folder, "cannot be written", error);
}

FolderLock::FolderLock(const fs::path& folder) : descriptor_(openFolder(folder)) {
  if (descriptor_ < 0) fail(folder, "cannot be opened", errno);
  while (::flock(descriptor_, LOCK_EX) != 0) {
    if (errno == EINTR) continue;
    const int error = errno;
    ::close(descriptor_);
    fail(folder, "cannot be locked", error);
  }
}

FolderLock::~FolderLock() { ::close(descriptor_); }

ScratchFolder::ScratchFolder(const fs::path& parent) : path_(scratchName(parent)) {
  // A crashed process of our number may have left a folder of this name.
  while (::mkdir(path_.c_str(), 0777) != 0) {
    if (errno != EEXIST) fail(path_, "cannot be made", errno);
    path_ = scratchName(parent);
  }
  owner_.emplace(path_);
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  if (!path_.empty()) fs::remove_all(path_, ignored);
}

void ScratchFolder::rename(const fs::path& target) {
  int failed = ::renameat2(AT_FDCWD, path_.c_str(), AT_FDCWD, target.c_str(), RENAME_NOREPLACE);
  if (failed != 0 && errno == EINVAL) failed = ::rename(path_.c_str(), target.c_str());  // a file system without it
  if (failed != 0) fail(target, "cannot be named", errno);
  path_.clear();
  syncFolder(target.parent_path());
}

void removeFolder(const fs::path& folder) {
  auto hidden = scratchName(folder.parent_path());
  while (::rename(folder.c_str(), hidden.c_str()) != 0) {
    if (errno != ENOTEMPTY && errno != EEXIST) fail(folder, "cannot be removed", errno);
    hidden = scratchName(folder.parent_path());
  }
  std::error_code error;
  fs::remove_all(hidden, error);
  if (error) fail(folder, "cannot be removed", error.value());
  syncFolder(folder.parent_path());
}

void removeAbandoned(const fs::path& parent) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(parent, error)) {
    if (!entry.path().filename().string().starts_with(kScratch)) continue;
    const int descriptor = openFolder(entry.path());
    if (descriptor < 0) continue;
    if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0) fs::remove_all(entry.path(), error);
    ::close(descriptor);
  }
}

}  // namespace shaped
