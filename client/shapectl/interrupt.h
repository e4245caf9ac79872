#pragma once

#include <stop_token>
#include <thread>

namespace shaped::shapectl {

/// Turns Ctrl-C (SIGINT) and SIGTERM into a stop token: the first one asks for a clean end, the second ends the program
/// at once with the code for "cancelled". A signal that the parent had set to be ignored stays ignored. One object a
/// program.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  std::stop_token token() const { return source_.get_token(); }

 private:
  std::stop_source source_;
  std::thread thread_;
};

}  // namespace shaped::shapectl
