#pragma once

#include <sys/resource.h>

#include <cstdint>

namespace shaped::test {

/// While it lives, no file of this process can grow beyond `bytes`: writing fails as on a full disk, with or without
/// privileges.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(std::uint64_t bytes);
  ~FileSizeLimit();
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_;
  void (*handler_before_)(int);
};

}  // namespace shaped::test
