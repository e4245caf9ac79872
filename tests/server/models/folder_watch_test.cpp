#include "server/models/folder_watch.h"

#include <catch2/catch.hpp>
#include <condition_variable>
#include <fstream>
#include <future>
#include <mutex>
#include <set>

#include "core/io/file_error.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::server;
namespace fs = std::filesystem;

namespace {

/// What a watch has reported, and a gate that can hold its thread.
class Reports {
 public:
  FolderWatch::Listener listener() {
    return {[this](const std::string& name) { add(name); }, [this](const std::string& text) { add("! " + text); }};
  }
  void add(const std::string& name) {
    std::unique_lock lock(mutex_);
    seen_.insert(name);
    came_.notify_all();
    came_.wait(lock, [this] { return !held_; });
  }
  /// Waits until each has been reported since the last call, at most a minute.
  bool come(const std::set<std::string>& wanted) {
    std::unique_lock lock(mutex_);
    const bool all = came_.wait_for(lock, std::chrono::minutes(1), [&] {
      return std::includes(seen_.begin(), seen_.end(), wanted.begin(), wanted.end());
    });
    seen_.clear();
    return all;
  }
  bool seen(const std::string& name) {
    const std::scoped_lock lock(mutex_);
    return seen_.contains(name);
  }
  void hold(bool held) {
    const std::scoped_lock lock(mutex_);
    held_ = held;
    came_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable came_;
  std::set<std::string> seen_;
  bool held_ = false;
};

/// A folder that is made elsewhere and renamed into place.
void publish(const fs::path& root, const std::string& name) {
  fs::create_directory(root / ".new");
  fs::rename(root / ".new", root / name);
}

}  // namespace

TEST_CASE("a watch reports what is there, what is renamed into place and what goes") {
  const test::TemporaryFolder folder;
  fs::create_directories(folder / "a/1");
  Reports reports;
  const FolderWatch watch(folder.path(), reports.listener());
  CHECK(reports.come({"a"}));
  publish(folder.path(), "a/2");
  CHECK(reports.come({"a"}));
  fs::create_directory(folder / "b");
  CHECK(reports.come({"b"}));
  publish(folder.path(), "b/1");
  CHECK(reports.come({"b"}));
  fs::remove(folder / "a/1");
  CHECK(reports.come({"a"}));
  fs::rename(folder / "b", folder / "c");
  CHECK(reports.come({"b", "c"}));
  publish(folder.path(), "c/2");  // reported by its name of now
  CHECK(reports.come({"c"}));
  fs::remove_all(folder / "c");
  CHECK(reports.come({"c"}));
}

TEST_CASE("a watch does not report what is created in a subfolder, nor what is hidden") {
  const test::TemporaryFolder folder;
  for (const auto* name : {"a", "b"}) fs::create_directory(folder / name);
  Reports reports;
  const FolderWatch watch(folder.path(), reports.listener());
  REQUIRE(reports.come({"a", "b"}));
  fs::create_directory(folder / "a/1");
  std::ofstream(folder / "a/1/manifest.json") << "half";
  fs::create_directory(folder / ".hidden");
  publish(folder.path(), "a/.2");
  publish(folder.path(), "b/1");  // comes last
  while (!reports.seen("b")) std::this_thread::yield();
  CHECK_FALSE(reports.seen("a"));
  CHECK_FALSE(reports.seen(".hidden"));
}

TEST_CASE("when more changes than the kernel's queue holds, a watch looks at everything") {
  std::ifstream limit("/proc/sys/fs/inotify/max_queued_events");
  int queued = 0;
  REQUIRE((limit >> queued));
  REQUIRE(queued < 1'000'000);
  const test::TemporaryFolder folder;
  for (const auto* name : {"a", "b"}) fs::create_directory(folder / name);
  Reports reports;
  const FolderWatch watch(folder.path(), reports.listener());
  REQUIRE(reports.come({"a", "b"}));
  reports.hold(true);  // its thread stays in the next report
  publish(folder.path(), "a/1");
  while (!reports.seen("a")) std::this_thread::yield();
  // Two events each; the kernel drops one that is like the one before it.
  for (int i = 0; i <= queued / 2; ++i) {
    publish(folder.path(), "a/2");
    fs::remove(folder / "a/2");
  }
  fs::create_directory(folder / "late");  // its event is lost
  reports.hold(false);
  CHECK(reports.come({"! more changed than the kernel's queue holds: looking at everything", "a", "b", "late"}));
  publish(folder.path(), "late/1");
  CHECK(reports.come({"late"}));
}

TEST_CASE("a folder that is not there cannot be watched") {
  const test::TemporaryFolder folder;
  Reports reports;
  CHECK_THROWS_AS(FolderWatch(folder / "none", reports.listener()), FileError);
}
