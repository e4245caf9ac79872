#pragma once

#include <string>
#include <vector>

namespace shaped::shapectl {

/// A terminal's other screen, redrawn in place; the first one comes back with the end of the object.
class LiveScreen {
 public:
  LiveScreen();
  ~LiveScreen();
  LiveScreen(const LiveScreen&) = delete;
  LiveScreen& operator=(const LiveScreen&) = delete;

  /// Cuts what does not fit.
  void show(const std::vector<std::string>& lines);
};

}  // namespace shaped::shapectl
