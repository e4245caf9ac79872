#pragma once

#include <atomic>

namespace shaped::server {

/// Whether a call has left its worker to wait for something. Of those who want to end the waiting, the thing that has
/// come and the stop that does not wait for it, exactly one gets the call.
class Parking {
 public:
  void enter() { parked_ = true; }
  /// True for the one who takes the call out.
  bool leave() { return parked_.exchange(false); }

 private:
  std::atomic<bool> parked_{false};
};

}  // namespace shaped::server
