#pragma once

#include <stdexcept>
#include <string>

namespace shaped {

/// The machine, not the input, is at fault: a full disk, a missing permission, a read error. Trying again may help.
class FileError : public std::runtime_error {
 public:
  /// path: the file or folder; problem: what failed and why ("cannot be written: No space left on device").
  FileError(std::string path, const std::string& problem)
      : std::runtime_error(path + ": " + problem), path_(std::move(path)) {}

  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace shaped
