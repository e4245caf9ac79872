#include "server/jobs/job_input.h"

#include "core/io/folder.h"

namespace shaped::server {
namespace {

std::filesystem::path made(const std::filesystem::path& folder) {
  makeFolder(folder);
  return folder;
}

/// Leaves no folder behind where there is no room for the file: what has not been made has no destructor.
RecordWriter opened(const std::filesystem::path& folder) {
  try {
    return {folder / kInputFile, 0};
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove_all(folder, ignored);
    throw;
  }
}

}  // namespace

JobInput::JobInput(const std::filesystem::path& jobs, std::string key)
    : key_(std::move(key)), folder_(made(jobs / key_)), writer_(opened(folder_)) {}

JobInput::~JobInput() {
  if (released_) return;
  std::error_code ignored;  // what stays behind is removed at the next start
  std::filesystem::remove_all(folder_, ignored);
}

void JobInput::append(std::string_view record) {
  writer_.append(record);
  // With its length: two records are not one that is as long.
  hash_.update(std::to_string(record.size()) + " ");
  hash_.update(record);
}

}  // namespace shaped::server
