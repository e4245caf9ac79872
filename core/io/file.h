#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace shaped {

/// The extension of a path in lower case, with its dot (".ply"); empty where there is none.
std::string extensionOf(const std::filesystem::path& path);

/// The whole content of a regular file. Throws InvalidInput naming the file when it cannot be opened, is not a regular
/// file or is empty; FileError when reading fails half-way.
std::string readFile(const std::filesystem::path& path);

/// Writes a file that appears under its name only when complete: the bytes go to a temporary file beside it, which
/// commit() renames. Destroyed before commit(), it leaves nothing behind and an older file of that name untouched.
/// A path that exists and is no regular file (a pipe, a device) is written directly.
/// Every failure throws FileError with the path and the system's reason.
class FileWriter {
 public:
  explicit FileWriter(std::filesystem::path path);
  ~FileWriter();
  FileWriter(const FileWriter&) = delete;
  FileWriter& operator=(const FileWriter&) = delete;

  /// Appends bytes.
  void write(std::string_view bytes);
  /// Overwrites bytes that were already written, at an offset from the start of the file.
  void patch(std::uint64_t offset, std::string_view bytes);
  /// Flushes to the disk and gives the file its name. Call once, last.
  void commit();

 private:
  [[noreturn]] void fail(const std::string& problem) const;

  std::filesystem::path path_, temporary_;
  int descriptor_ = -1;
};

/// Writes a whole file through FileWriter.
void writeFile(const std::filesystem::path& path, std::string_view bytes);

}  // namespace shaped
