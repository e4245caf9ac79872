#pragma once

#include <mutex>

namespace shaped {

/// While it lives, METIS, called by this thread, leaves the process alone, and the process METIS. As it comes, METIS
/// - draws from the C library's generator of random numbers: whoever else uses that (gRPC, at each connection) or a
///   second ordering at the same time changes the order, and with it all roundings that follow;
/// - takes over SIGTERM while it orders: a daemon told to stop just then would jump to nowhere.
/// So the program's own rand, srand and __sysv_signal stand before the C library's. One at a time in the process, as
/// METIS does take over SIGABRT, by which it reports that memory ran out.
class MetisIsolation {
 public:
  MetisIsolation();
  ~MetisIsolation();
  MetisIsolation(const MetisIsolation&) = delete;
  MetisIsolation& operator=(const MetisIsolation&) = delete;

 private:
  std::unique_lock<std::mutex> alone_;
};

}  // namespace shaped
