#pragma once

#include <stop_token>
#include <thread>

namespace shaped::shapectl {

/// Turns Ctrl-C (SIGINT) and SIGTERM into a stop token: the first one asks for a clean end, the second ends the program
/// at once with the code for "cancelled". Create it first in main, before any thread, which then all leave the signals
/// to it.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  std::stop_token token() const { return source_.get_token(); }

 private:
  void waitForSignals();

  std::stop_source source_;
  std::thread thread_;
};

}  // namespace shaped::shapectl
