#include "server/process/run_program.h"

#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <csignal>
#include <cstdio>
#include <system_error>
#include <thread>

#include "core/io/file.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::server;
using namespace std::chrono_literals;
using Catch::Contains;

namespace {

using Clock = std::chrono::steady_clock;

Program shell(const std::string& script) { return {.path = "/bin/sh", .arguments = {"-c", script}}; }

ProgramEnd run(const Program& program, std::vector<std::string>& lines, const std::stop_token& stop = {}) {
  return runProgram(
      program, [&](const std::string& line) { lines.push_back(line); }, stop);
}

ProgramEnd run(const Program& program) {
  std::vector<std::string> lines;
  return run(program, lines);
}

}  // namespace

TEST_CASE("a program's lines, errors and exit code are heard") {
  std::vector<std::string> lines;
  const auto end = run(shell("echo one; echo wrong >&2; echo two; printf three; exit 7"), lines);
  CHECK(lines == std::vector<std::string>{"one", "two"});  // what has no end is no line
  CHECK(end.exit_code == 7);
  CHECK(end.signal == 0);
  CHECK(end.errors == "wrong\n");
}

TEST_CASE("a program that a signal ended says which") {
  const auto end = run(shell("kill -9 $$"));
  CHECK(end.signal == SIGKILL);
  CHECK(end.exit_code == -1);
}

TEST_CASE("much output does not stop a program, and of errors the end is kept") {
  std::vector<std::string> lines;
  const auto end =
      run(shell("i=0; while [ $i -lt 20000 ]; do echo line $i; echo error $i >&2; i=$((i+1)); done"), lines);
  CHECK(lines.size() == 20000);
  CHECK(lines.back() == "line 19999");
  CHECK(end.errors.size() <= 4096);
  CHECK_THAT(end.errors, Contains("error 19999\n"));
}

TEST_CASE("a program that is asked to stop may tidy up, and one that does not listen is killed") {
  std::stop_source stop;
  const auto stopAfter = [&](const Program& program) {
    std::vector<std::string> lines;
    return runProgram(
        program,
        [&](const std::string& line) {
          lines.push_back(line);
          if (line == "ready") stop.request_stop();
        },
        stop.get_token());
  };
  const auto begin = Clock::now();
  CHECK(stopAfter(shell("trap 'exit 3' TERM; echo ready; while :; do sleep 0.05; done")).exit_code == 3);
  stop = {};
  auto deaf = shell("trap '' TERM; echo ready; while :; do sleep 0.05; done");
  deaf.grace = 200ms;
  CHECK(stopAfter(deaf).signal == SIGKILL);
  CHECK(Clock::now() - begin < 10s);
}

TEST_CASE("who hears a line may end the program by throwing") {
  const auto program = shell("echo first; exec sleep 60");
  const auto begin = Clock::now();
  CHECK_THROWS_WITH(runProgram(program, [](const std::string&) { throw std::runtime_error("no more"); }, {}),
                    "no more");
  CHECK(Clock::now() - begin < 10s);
}

TEST_CASE("what a program leaves running keeps nobody waiting") {
  const auto begin = Clock::now();
  CHECK(run(shell("sleep 60 & exit 0")).exit_code == 0);
  CHECK(Clock::now() - begin < 10s);
}

TEST_CASE("a program inherits neither our descriptors nor our signals") {
  const test::TemporaryFolder folder;
  writeFile(folder / "file", "content");
  FILE* open = std::fopen((folder / "file").c_str(), "r");
  sigset_t blocked, before;
  sigemptyset(&blocked);
  sigaddset(&blocked, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &blocked, &before);
  const auto pipe_before = std::signal(SIGPIPE, SIG_IGN);
  std::vector<std::string> lines;
  run(shell("ls /proc/self/fd | wc -l; grep SigBlk /proc/self/status; grep SigIgn /proc/self/status; cat"), lines);
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  std::signal(SIGPIPE, pipe_before);
  std::fclose(open);
  REQUIRE(lines.size() == 3);       // cat found its input at the end
  CHECK(std::stoi(lines[0]) == 4);  // 0, 1, 2 and the folder that ls looks into
  CHECK_THAT(lines[1], Contains("0000000000000000"));
  const auto ignored = std::stoull(lines[2].substr(lines[2].find('\t')), nullptr, 16);
  CHECK((ignored & (1ULL << (SIGPIPE - 1))) == 0);
}

TEST_CASE("no child is left behind, and a program that is not there is said so") {
  run(shell("exit 0"));
  CHECK(::waitpid(-1, nullptr, WNOHANG) == -1);
  CHECK_THROWS_WITH(run({.path = "/no/such/program", .arguments = {}}), Contains("/no/such/program cannot be started"));
  CHECK(::waitpid(-1, nullptr, WNOHANG) == -1);
  const test::TemporaryFolder folder;
  writeFile(folder / "text", "no program");
  CHECK(isProgram("/bin/sh"));
  CHECK_FALSE(isProgram(folder / "text"));
  CHECK_FALSE(isProgram(folder.path()));
  CHECK_FALSE(isProgram("/no/such/program"));
}
