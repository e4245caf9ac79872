#pragma once

#include <functional>

namespace shaped::server {

/// Runs the work in a TBB arena of its own with at most `threads` threads, all limited to one OpenMP thread.
void runInArena(int threads, const std::function<void()>& work);

}  // namespace shaped::server
