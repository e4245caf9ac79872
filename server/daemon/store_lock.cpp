#include "server/daemon/store_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <system_error>

#include "core/io/file_error.h"
#include "core/numerics/error.h"

namespace shaped::server {

StoreLock::StoreLock(const std::filesystem::path& store) {
  const auto reason = [] { return std::generic_category().message(errno); };
  std::error_code problem;
  std::filesystem::create_directories(store, problem);
  if (problem) throw FileError(store.string(), "cannot be created: " + problem.message());
  const auto path = (store / ".lock").string();
  descriptor_ = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (descriptor_ < 0) throw FileError(path, "cannot be written: " + reason());
  if (flock(descriptor_, LOCK_EX | LOCK_NB) == 0) return;
  close(descriptor_);
  throw InvalidInput("--store", store.string() + " is served by another daemon; stop that one or name another folder");
}

StoreLock::~StoreLock() { close(descriptor_); }

}  // namespace shaped::server
