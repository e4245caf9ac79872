#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

namespace shaped::server {

/// How a program ended.
struct ProgramEnd {
  int exit_code = -1;  ///< -1 where a signal ended it
  int signal = 0;      ///< 0 where it ended by itself
  std::string errors;  ///< the end of what it wrote to standard error, at most 4 KiB
};

/// A program to run, without a shell.
struct Program {
  std::filesystem::path path;
  std::vector<std::string> arguments;  ///< without its own name
  /// Asked to stop by SIGTERM, it has so long until SIGKILL.
  std::chrono::duration<double> grace = std::chrono::seconds(30);
};

/// Whether there is such a program and we may run it.
bool isProgram(const std::filesystem::path& path);

/// Runs a program beside this one and waits until it has ended, on the calling thread, which hears every line that it
/// writes to standard output. It has no standard input, none of our descriptors, no signal blocked, the environment and
/// the priority of the calling thread; it is asked to stop when the token fires, or `line` throws, which is thrown on
/// once it has ended. Whatever it leaves running does not keep this waiting. A program that wants to end with the
/// thread that started it says so itself (PR_SET_PDEATHSIG).
///
/// Throws std::system_error naming the program when it cannot be started.
ProgramEnd runProgram(const Program& program, const std::function<void(const std::string& line)>& line,
                      const std::stop_token& stop);

}  // namespace shaped::server
