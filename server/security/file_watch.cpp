#include "server/security/file_watch.h"

#include <sys/stat.h>

namespace shaped::server {
namespace {

std::vector<long long> fingerprintOf(const std::vector<std::filesystem::path>& files) {
  std::vector<long long> numbers;
  for (const auto& file : files) {
    struct stat status {};
    if (stat(file.c_str(), &status) != 0) status = {};
    for (const long long number :
         {static_cast<long long>(status.st_dev), static_cast<long long>(status.st_ino),
          static_cast<long long>(status.st_size), static_cast<long long>(status.st_mtim.tv_sec),
          static_cast<long long>(status.st_mtim.tv_nsec)})
      numbers.push_back(number);
  }
  return numbers;
}

}  // namespace

FileWatch::FileWatch(std::vector<std::filesystem::path> files, std::chrono::milliseconds period,
                     std::function<void()> changed)
    : files_(std::move(files)), period_(period), changed_(std::move(changed)), seen_(fingerprintOf(files_)) {
  thread_ = std::thread([this] { watch(); });
}

FileWatch::~FileWatch() {
  {
    const std::scoped_lock lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void FileWatch::watch() {
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, period_, [this] { return stopping_; })) {
    auto now = fingerprintOf(files_);
    if (now == seen_) continue;
    seen_ = std::move(now);
    lock.unlock();
    changed_();
    lock.lock();
  }
}

}  // namespace shaped::server
