#pragma once

#include <filesystem>

namespace shaped::server {

/// Keeps a second daemon off a store while it lives; the lock ends with the process, however that ends.
class StoreLock {
 public:
  /// Creates the folder if need be. Throws InvalidInput naming the store when another daemon serves it, FileError when
  /// it cannot be written.
  explicit StoreLock(const std::filesystem::path& store);
  ~StoreLock();
  StoreLock(const StoreLock&) = delete;
  StoreLock& operator=(const StoreLock&) = delete;

 private:
  int descriptor_;
};

}  // namespace shaped::server
