#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>

namespace shaped::server {

/// Files of byte records, one after the other, each with its length and a checksum: written as work goes on, cut off
/// where a crash tore them.

/// Appends records. One thread at a time.
class RecordWriter {
 public:
  static constexpr std::int64_t kAll = std::numeric_limits<std::int64_t>::max();

  /// Opens or makes the file, goes behind its first `keep` records, or all that are whole (kAll), and cuts off the rest.
  /// Throws Corrupted when fewer than `keep` are whole; FileError.
  RecordWriter(const std::filesystem::path& path, std::int64_t keep);
  ~RecordWriter();
  RecordWriter(const RecordWriter&) = delete;
  RecordWriter& operator=(const RecordWriter&) = delete;

  /// Throws FileError: then the file is as it was.
  void append(std::string_view record);
  /// What was appended is on the disk when this returns. Throws FileError.
  void sync();

  std::int64_t count() const { return count_; }
  std::int64_t bytes() const { return end_; }

 private:
  [[noreturn]] void fail(const std::string& problem) const;
  void goBehind(std::int64_t keep);

  const std::filesystem::path path_;
  int descriptor_ = -1;
  std::int64_t count_ = 0, end_ = 0;
};

/// Reads the records of a file from its first. One thread at a time; the file may be removed meanwhile.
class RecordReader {
 public:
  /// Throws FileError when the file cannot be opened.
  explicit RecordReader(const std::filesystem::path& path);
  ~RecordReader();
  RecordReader(const RecordReader&) = delete;
  RecordReader& operator=(const RecordReader&) = delete;

  /// The next record; false at the end of the file. Throws Corrupted for one that is torn or damaged, FileError.
  bool next(std::string& record);
  /// Where the next record begins.
  std::int64_t position() const { return at_; }

 private:
  const std::filesystem::path path_;
  int descriptor_ = -1;
  std::int64_t at_ = 0, size_ = 0;
};

}  // namespace shaped::server
