#include <cstdarg>
#include <cstdio>

#include "tests/benchmark/experiments/experiment.h"

namespace shaped::experiments {

Report::Report(const std::string& title) {
  std::printf("\n### %s\n\n| quantity | measured | target | met |\n|---|---|---|---|\n", title.c_str());
  std::fflush(stdout);
}

void Report::entry(const std::string& quantity, const std::string& measured, const std::string& target, bool met) {
  std::printf("| %s | %s | %s | %s |\n", quantity.c_str(), measured.c_str(), target.c_str(), met ? "yes" : "**no**");
  std::fflush(stdout);
}

void Report::entry(const std::string& quantity, const std::string& measured) {
  std::printf("| %s | %s | | |\n", quantity.c_str(), measured.c_str());
  std::fflush(stdout);
}

std::string text(const char* format, ...) {
  char buffer[512];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(buffer, sizeof buffer, format, arguments);
  va_end(arguments);
  return buffer;
}

}  // namespace shaped::experiments
