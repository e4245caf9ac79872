#pragma once

#include <filesystem>
#include <string>

#include "core/io/sha256.h"
#include "server/jobs/record_file.h"

namespace shaped::server {

/// Names of the files in a job's folder that every kind means the same by. Others are the kind's own and go when the job
/// has ended.
inline constexpr const char* kInputFile = "input";    ///< what a client sent for the job
inline constexpr const char* kResultFile = "result";  ///< kept as long as the record of a job that has succeeded

/// What a client sends for a job before there is one: records in the folder that the job will have. Destroyed before the
/// job is started with it (JobRunner::start), it leaves nothing.
class JobInput {
 public:
  /// key: of the job to be. Throws FileError.
  JobInput(const std::filesystem::path& jobs, std::string key);
  ~JobInput();
  JobInput(const JobInput&) = delete;
  JobInput& operator=(const JobInput&) = delete;

  const std::string& key() const { return key_; }
  /// Throws FileError.
  void append(std::string_view record);
  std::int64_t count() const { return writer_.count(); }
  std::int64_t bytes() const { return writer_.bytes(); }
  /// SHA-256 of all records. Call once, after the last.
  std::string hash() { return hash_.finish(); }

 private:
  friend class JobRunner;
  void sync() { writer_.sync(); }
  void release() { released_ = true; }

  const std::string key_;
  const std::filesystem::path folder_;
  RecordWriter writer_;
  Sha256 hash_;
  bool released_ = false;
};

}  // namespace shaped::server
