#include "server/security/security.h"

#include <catch2/catch.hpp>
#include <filesystem>

#include "core/io/file.h"
#include "server/security/loopback.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::server;
using Catch::Contains;

namespace {

SecurityOptions withFiles(const std::string& chain, const std::string& key, const std::string& client_ca = "") {
  SecurityOptions options;
  options.certificates = {chain, key, client_ca};
  return options;
}

SecurityOptions withTokens(const std::filesystem::path& tokens) {
  SecurityOptions options;
  options.tokens = tokens;
  return options;
}

}  // namespace

TEST_CASE("loopback addresses are told from others") {
  for (const auto* address : {"127.0.0.1:1", "127.255.0.9:0", "[::1]:50051", "localhost:7", "[::ffff:127.0.0.1]:7",
                              "unix:/run/shaped.sock", "unix-abstract:shaped"})
    CHECK(isLoopback(address));
  for (const auto* address :
       {"0.0.0.0:1", "[::]:1", "192.168.1.1:1", "128.0.0.1:1", "[::ffff:10.0.0.1]:1", "[fe80::1]:1", "::1:50051",
        "127.0.0.1", ":50051", "", "[::1", "no.such.host.invalid:1", "dns:///localhost:1"})
    CHECK_FALSE(isLoopback(address));
}

TEST_CASE("options that do not go together are refused by name") {
  const auto refused = [](const SecurityOptions& options, const std::string& listen, const std::string& reason) {
    CHECK_THROWS_WITH(Security(options, listen), Contains(reason));
  };
  refused({}, "0.0.0.0:1", "--listen: 0.0.0.0:1 can be reached from other machines");
  refused(withFiles("c", ""), "127.0.0.1:1", "--tls-key: is missing");
  refused(withFiles("", "k"), "127.0.0.1:1", "--tls-cert: is missing");
  refused(withFiles("", "", "a"), "127.0.0.1:1", "--tls-client-ca: needs --tls-cert");
  refused(withFiles("/nowhere/c", "/nowhere/k"), "0.0.0.0:1", "--tls-cert: /nowhere/c");
  refused(withTokens("/nowhere/t"), "127.0.0.1:1", "--tokens: /nowhere/t");
  SecurityOptions anywhere;
  anywhere.anywhere = true;
  CHECK_NOTHROW(Security(anywhere, "0.0.0.0:1"));
}

TEST_CASE("a tokens file that everybody may write is refused") {
  const test::TemporaryFolder folder;
  const auto file = folder / "tokens.json";
  writeFile(file, "{}");
  namespace fs = std::filesystem;
  fs::permissions(file, fs::perms::others_write, fs::perm_options::add);
  CHECK_THROWS_WITH(Security(withTokens(file), "127.0.0.1:1"),
                    Contains("--tokens:") && Contains("can be written by every"));
  fs::permissions(file, fs::perms::others_write, fs::perm_options::remove);
  CHECK_NOTHROW(Security(withTokens(file), "127.0.0.1:1"));
}

TEST_CASE("a faulty new tokens file leaves the old one in force") {
  const test::TemporaryFolder folder;
  const auto file = folder / "tokens.json";
  writeFile(file, R"({"certificates": {"farm": ["read"]}})");
  Security security(withTokens(file), "127.0.0.1:1");
  const Credentials farm{{}, "farm"}, barn{{}, "barn"};
  writeFile(file, R"({"certificates": {"barn": ["read"])");
  security.reload();
  CHECK(security.access()->nameOf(farm) == "farm");
  writeFile(file, R"({"certificates": {"barn": ["read"]}})");
  security.reload();
  CHECK(security.access()->nameOf(farm).empty());
  CHECK(security.access()->nameOf(barn) == "barn");
}

TEST_CASE("a file is watched through links, and its coming and going counts") {
  const test::TemporaryFolder folder;
  std::atomic<int> changes{0};
  const auto waitFor = [&](int count) {
    for (int i = 0; i < 500 && changes < count; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return changes == count;
  };
  writeFile(folder / "first", "1");
  writeFile(folder / "second", "2");
  std::filesystem::create_symlink(folder / "first", folder / "link");
  const FileWatch watch({folder / "link"}, std::chrono::milliseconds(10), [&] { ++changes; });
  std::this_thread::sleep_for(std::chrono::milliseconds(60));
  CHECK(changes == 0);
  std::filesystem::create_symlink(folder / "second", folder / "next");
  std::filesystem::rename(folder / "next", folder / "link");
  CHECK(waitFor(1));
  std::filesystem::remove(folder / "second");
  CHECK(waitFor(2));
}
