#include "server/rpc/caller.h"

#include <catch2/catch.hpp>

#include "core/numerics/error.h"

using namespace shaped;
using namespace shaped::server;
using Catch::Contains;

TEST_CASE("a host is what connections from it have in common") {
  CHECK(hostOf("ipv4:10.0.0.7:53012") == "ipv4:10.0.0.7");
  CHECK(hostOf("ipv6:%5B::1%5D:53012") == "ipv6:%5B::1%5D");
  CHECK(hostOf("unix:/run/shaped:1.sock") == "unix:/run/shaped:1.sock");
  CHECK(hostOf("unix:").starts_with("unix:"));
  CHECK(hostOf("").empty());
}

TEST_CASE("clients are told apart by name, else by host, and no host is a name") {
  CHECK(clientKey("studio", "ipv4:10.0.0.7:1") == clientKey("studio", "ipv4:10.0.0.8:1"));
  CHECK(clientKey("", "ipv4:10.0.0.7:1") == clientKey("", "ipv4:10.0.0.7:2"));
  CHECK(clientKey("", "ipv4:10.0.0.7:1") != clientKey("", "ipv4:10.0.0.8:1"));
  CHECK(clientKey("ipv4:10.0.0.7", "ipv4:10.0.0.8:1") != clientKey("", "ipv4:10.0.0.7:1"));
}

TEST_CASE("a priority is one of three words, or normal") {
  CHECK(priorityOf(std::vector<std::string_view>{}) == Priority::kNormal);
  for (const auto priority : kPriorities) CHECK(priorityOf({name(priority)}) == priority);
  CHECK_THROWS_WITH(priorityOf({"urgent"}),
                    Contains("shaped-priority: \"urgent\" is no priority; use interactive, normal or batch"));
  CHECK_THROWS_AS(priorityOf({""}), InvalidInput);
  CHECK_THROWS_AS(priorityOf({"Batch"}), InvalidInput);
  CHECK_THROWS_WITH(priorityOf({"batch", "batch"}), Contains("more than once"));
}
