#pragma once

#include <string>

namespace shaped::shapectl {

/// A bar on stderr, redrawn in place; silent when stderr is no terminal. Removes itself when it goes out of scope.
class ProgressBar {
 public:
  ProgressBar();
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// fraction in [0, 1]; the text stands behind the bar.
  void show(double fraction, const std::string& text);
  /// Makes room for a line of something else.
  void clear();

 private:
  bool enabled_;
};

}  // namespace shaped::shapectl
