#include "server/process/run_program.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <exception>
#include <string_view>
#include <system_error>
#include <utility>

namespace shaped::server {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kLookMilliseconds = 50;  ///< at most so long until a stop is seen
constexpr std::size_t kMostErrorBytes = 4096, kMostLineBytes = 1 << 20;

[[noreturn]] void fail(int error, const std::string& what) {
  throw std::system_error(error, std::generic_category(), what);
}

class Descriptor {
 public:
  explicit Descriptor(int number = -1) : number_(number) {}
  ~Descriptor() { close(); }
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    close();
    number_ = std::exchange(other.number_, -1);
    return *this;
  }
  int number() const { return number_; }
  void close() {
    if (number_ >= 0) ::close(number_);
    number_ = -1;
  }

 private:
  int number_;
};

struct Pipe {
  Descriptor read, write;

  Pipe() {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) fail(errno, "a pipe cannot be made");
    read = Descriptor(ends[0]);
    write = Descriptor(ends[1]);
    ::fcntl(ends[0], F_SETFL, O_NONBLOCK);
  }
};

/// What posix_spawn is to do in the child before it is another program.
class SpawnSettings {
 public:
  SpawnSettings(int out, int err) {
    posix_spawn_file_actions_init(&actions_);
    posix_spawnattr_init(&attributes_);
    posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions_, out, STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions_, err, STDERR_FILENO);
    posix_spawn_file_actions_addclosefrom_np(&actions_, STDERR_FILENO + 1);
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawnattr_setsigmask(&attributes_, &none);
    posix_spawnattr_setsigdefault(&attributes_, &all);  // what we ignore, SIGPIPE, would stay ignored
    posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  }
  ~SpawnSettings() {
    posix_spawn_file_actions_destroy(&actions_);
    posix_spawnattr_destroy(&attributes_);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;

  const posix_spawn_file_actions_t* actions() const { return &actions_; }
  const posix_spawnattr_t* attributes() const { return &attributes_; }

 private:
  posix_spawn_file_actions_t actions_;
  posix_spawnattr_t attributes_;
};

pid_t spawn(const Program& program, int out, int err) {
  const SpawnSettings settings(out, err);
  std::string name = program.path.string();
  auto arguments = program.arguments;
  std::vector<char*> words{name.data()};
  for (auto& argument : arguments) words.push_back(argument.data());
  words.push_back(nullptr);
  pid_t child = -1;
  if (const int error =
          ::posix_spawn(&child, name.c_str(), settings.actions(), settings.attributes(), words.data(), environ))
    fail(error, name + " cannot be started");
  return child;
}

/// Reads what is there; false at the end of the pipe.
template <class Take>
bool drain(int descriptor, const Take& take) {
  std::array<char, 4096> buffer{};
  while (true) {
    const auto count = ::read(descriptor, buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return count < 0;
    take(std::string_view(buffer.data(), static_cast<std::size_t>(count)));
  }
}

/// Cuts a stream of bytes into lines; one without an end is cut where it is too long.
class Lines {
 public:
  template <class Line>
  void add(std::string_view bytes, const Line& line) {
    for (const char byte : bytes) {
      if (byte != '\n') rest_ += byte;
      if (byte != '\n' && rest_.size() < kMostLineBytes) continue;
      line(std::exchange(rest_, {}));
    }
  }

 private:
  std::string rest_;
};

/// A child until it has been waited for: dies with this object.
class Child {
 public:
  Child(const Program& program, int out, int err)
      : process_(spawn(program, out, err)), grace_(program.grace), handle_(open(process_)) {}
  ~Child() {
    if (waited_) return;
    ::kill(process_, SIGKILL);
    wait();
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  /// Readable once it has ended; -1 where the system has no such descriptors.
  int handle() const { return handle_.number(); }

  /// Asks it to stop, once; and when it has not done so in time, ends it.
  void stop() {
    if (!stopping_) {
      stopping_ = true;
      stopped_ = Clock::now();
      ::kill(process_, SIGTERM);
    } else if (Clock::now() - stopped_ >= grace_) {
      ::kill(process_, SIGKILL);
    }
  }

  /// Whether it has ended; then its number is free for others.
  bool ended(ProgramEnd& end) {
    int status = 0;
    if (waited_ || ::waitpid(process_, &status, WNOHANG) != process_) return waited_;
    waited_ = true;
    if (WIFEXITED(status)) end.exit_code = WEXITSTATUS(status);
    if (WIFSIGNALED(status)) end.signal = WTERMSIG(status);
    return true;
  }

 private:
  static Descriptor open(pid_t process) { return Descriptor(static_cast<int>(::syscall(SYS_pidfd_open, process, 0))); }
  void wait() {
    while (::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
    }
    waited_ = true;
  }

  const pid_t process_;
  const std::chrono::duration<double> grace_;
  const Descriptor handle_;
  bool stopping_ = false, waited_ = false;
  Clock::time_point stopped_;
};

}  // namespace

bool isProgram(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(path, ignored) && ::access(path.c_str(), X_OK) == 0;
}

ProgramEnd runProgram(const Program& program, const std::function<void(const std::string& line)>& line,
                      const std::stop_token& stop) {
  Pipe out, err;
  Child child(program, out.write.number(), err.write.number());
  out.write.close();
  err.write.close();
  ProgramEnd end;
  Lines lines;
  std::exception_ptr failure;
  const auto hear = [&](const std::string& one) {
    if (failure) return;
    try {
      line(one);
    } catch (...) {
      failure = std::current_exception();
    }
  };
  for (bool ended = false; !ended;) {
    std::array<pollfd, 3> waiting{
        pollfd{out.read.number(), POLLIN, 0}, {err.read.number(), POLLIN, 0}, {child.handle(), POLLIN, 0}};
    ::poll(waiting.data(), waiting.size(), kLookMilliseconds);
    ended = child.ended(end);  // first: what it wrote before is in the pipes
    if (!drain(out.read.number(), [&](std::string_view bytes) { lines.add(bytes, hear); })) out.read.close();
    if (!drain(err.read.number(), [&](std::string_view bytes) { end.errors += bytes; })) err.read.close();
    if (end.errors.size() > kMostErrorBytes) end.errors.erase(0, end.errors.size() - kMostErrorBytes);
    if (!ended && (failure || stop.stop_requested())) child.stop();
  }
  if (failure) std::rethrow_exception(failure);
  return end;
}

}  // namespace shaped::server
