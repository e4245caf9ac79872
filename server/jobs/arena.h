#pragma once

#include <functional>

namespace shaped::server {

/// Runs the work in a TBB arena of its own with at most `threads` threads, all limited to one OpenMP thread.
void runInArena(int threads, const std::function<void()>& work);

/// As runInArena(), on threads that give way to all others: where processors are short, a request gets some nine tenths
/// of one. The calling thread is one of them, and stays so for ever; so do TBB's own, which must serve nothing else.
void runInBackground(int threads, const std::function<void()>& work);

}  // namespace shaped::server
