#pragma once

#include <algorithm>
#include <mutex>
#include <string>
#include <vector>

namespace shaped::server {

/// What a running job has told those who watch it, in order. Safe from any thread.
class JobNews {
 public:
  void add(std::string item) {
    const std::scoped_lock lock(mutex_);
    items_.push_back(std::move(item));
  }
  /// At most so many from `first` on.
  std::vector<std::string> from(std::size_t first, std::size_t most) const {
    const std::scoped_lock lock(mutex_);
    if (first >= items_.size()) return {};
    const auto begin = items_.begin() + static_cast<std::ptrdiff_t>(first);
    return {begin, begin + static_cast<std::ptrdiff_t>(std::min(most, items_.size() - first))};
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> items_;
};

}  // namespace shaped::server
