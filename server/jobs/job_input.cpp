#include "server/jobs/job_input.h"

#include "core/io/folder.h"

namespace shaped::server {
namespace {

std::filesystem::path made(const std::filesystem::path& folder) {
  makeFolder(folder);
  return folder;
}

}  // namespace

JobInput::JobInput(const std::filesystem::path& jobs, std::string key)
    : key_(std::move(key)), folder_(made(jobs / key_)), writer_(folder_ / kInputFile, 0) {}

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
