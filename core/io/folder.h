#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace shaped {

/// Makes a folder, its parent there already; nothing when it exists. The new entry is on the disk when this returns.
/// Throws FileError.
void makeFolder(const std::filesystem::path& folder);

/// Writes a folder's entries to the disk. Throws FileError.
void syncFolder(const std::filesystem::path& folder);

/// Holds an exclusive lock on a folder among all threads and processes of the machine; a crash releases it.
class FolderLock {
 public:
  /// Waits for the lock. Throws FileError when the folder cannot be opened.
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_;
};

/// A new folder with a hidden name beside the things it will become, locked by its owner; removed with all it holds
/// unless it was renamed.
class ScratchFolder {
 public:
  explicit ScratchFolder(const std::filesystem::path& parent);
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// Gives it its final name, which must be free. Throws FileError.
  void rename(const std::filesystem::path& target);

 private:
  std::filesystem::path path_;
  std::optional<FolderLock> owner_;
};

/// Moves a folder out of sight at once, then removes it. Call with its parent locked. Throws FileError.
void removeFolder(const std::filesystem::path& folder);

/// Removes scratch folders in `parent` that no living owner holds. Call with `parent` locked.
void removeAbandoned(const std::filesystem::path& parent);

}  // namespace shaped
