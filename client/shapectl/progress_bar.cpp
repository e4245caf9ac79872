#include "client/shapectl/progress_bar.h"

#include <unistd.h>

#include <algorithm>
#include <iostream>

namespace shaped::shapectl {

ProgressBar::ProgressBar() : enabled_(isatty(STDERR_FILENO) != 0) {}

ProgressBar::~ProgressBar() { clear(); }

void ProgressBar::clear() {
  if (enabled_) std::cerr << "\r\x1b[K" << std::flush;
}

void ProgressBar::show(double fraction, const std::string& text) {
  if (!enabled_) return;
  constexpr int width = 30;
  const int filled = static_cast<int>(std::clamp(fraction, 0.0, 1.0) * width);
  std::cerr << "\r\x1b[K[" << std::string(filled, '#') << std::string(width - filled, '.') << "] "
            << static_cast<int>(100 * std::clamp(fraction, 0.0, 1.0)) << " % " << text << std::flush;
}

}  // namespace shaped::shapectl
