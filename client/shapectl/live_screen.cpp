#include "client/shapectl/live_screen.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <iostream>

namespace shaped::shapectl {

LiveScreen::LiveScreen() { std::cout << "\x1b[?1049h\x1b[?25l" << std::flush; }
LiveScreen::~LiveScreen() { std::cout << "\x1b[?25h\x1b[?1049l" << std::flush; }

void LiveScreen::show(const std::vector<std::string>& lines) {
  winsize size{};
  const bool known = ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_row > 0 && size.ws_col > 0;
  const std::size_t rows = known ? size.ws_row : 24, columns = known ? size.ws_col : 80;
  // Line by line over what was there: clearing first would flicker.
  std::string text = "\x1b[H";
  for (std::size_t i = 0; i < std::min(lines.size(), rows); ++i)
    text += (i > 0 ? "\r\n" : "") + lines[i].substr(0, columns) + "\x1b[K";
  std::cout << text << "\x1b[J" << std::flush;
}

}  // namespace shaped::shapectl
