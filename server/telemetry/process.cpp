#include "server/telemetry/process.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace shaped::server {
namespace {

/// The first word of a file as a number; 0 when there is none.
std::uint64_t numberIn(const std::string& path) {
  std::ifstream file(path);
  std::uint64_t number = 0;
  return file >> number ? number : 0;
}

std::uint64_t pages(int name) {
  const long count = sysconf(name);
  return count < 0 ? 0 : static_cast<std::uint64_t>(count) * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

/// Inside a container its own group is the root; a larger limit than the machine has means that there is none.
std::uint64_t memoryLimit() {
  std::uint64_t limit = pages(_SC_PHYS_PAGES);
  for (const char* path : {"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"})
    if (const auto group = numberIn(path); group > 0) limit = std::min(limit, group);
  return limit;
}

std::uint64_t openFiles() {
  std::error_code problem;
  std::filesystem::directory_iterator at("/proc/self/fd", problem);
  std::uint64_t count = 0;
  while (!problem && at != std::filesystem::directory_iterator()) {
    ++count;
    at.increment(problem);
  }
  return count > 0 ? count - 1 : 0;  // one of them is the iterator's
}

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

/// Fields of /proc/self/stat, numbered from 1 as in proc(5); the second may hold spaces and ends at the last ')'.
std::uint64_t statField(int wanted) {
  std::ifstream file("/proc/self/stat");
  std::string text;
  std::getline(file, text);
  std::istringstream rest(text.substr(std::min(text.size(), text.rfind(')') + 1)));
  std::string word;
  for (int field = 3; field <= wanted; ++field) rest >> word;
  return word.empty() ? 0 : std::strtoull(word.c_str(), nullptr, 10);
}

std::uint64_t bootSeconds() {
  std::ifstream file("/proc/stat");
  std::string key;
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("btime ")) return std::strtoull(line.c_str() + 6, nullptr, 10);
  return 0;
}

/// Never changes while the process lives.
double startSeconds() {
  constexpr int kStartTime = 22;
  static const double start = static_cast<double>(bootSeconds()) +
                              static_cast<double>(statField(kStartTime)) / static_cast<double>(sysconf(_SC_CLK_TCK));
  return start;
}

}  // namespace

ProcessStatistics processStatistics() {
  constexpr int kThreads = 20, kResidentPages = 24;
  ProcessStatistics process;
  process.resident_bytes = statField(kResidentPages) * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  process.threads = statField(kThreads);
  process.memory_limit_bytes = memoryLimit();
  process.open_files = openFiles();
  process.start_seconds = startSeconds();
  rusage usage{};
  if (getrusage(RUSAGE_SELF, &usage) == 0) process.cpu_seconds = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  rlimit files{};
  if (getrlimit(RLIMIT_NOFILE, &files) == 0) process.most_open_files = files.rlim_cur;
  return process;
}

}  // namespace shaped::server
