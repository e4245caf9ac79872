#include "client/target.h"

#include <catch2/catch.hpp>

#include <fstream>
#include <nlohmann/json.hpp>

#include "client/connection.h"
#include "client/retries.h"
#include "core/numerics/error.h"

using namespace shaped;
using namespace shaped::client;

TEST_CASE("One server stays as it was written", "[client]") {
  for (const std::string server : {"localhost:50051", "[::1]:1", "unix:/run/shaped/a,b.sock"}) {
    INFO(server);
    const auto target = targetOf(server);
    CHECK(target.uri == server);
    CHECK_FALSE(target.balanced);
    CHECK(target.authority.empty());
  }
  CHECK(targetOf("dns:///shapes.example:50051").balanced);
  CHECK(targetOf("ipv4:127.0.0.1:1,127.0.0.2:2").balanced);
}

TEST_CASE("Several replicas become one target of addresses", "[client]") {
  const auto four = targetOf("127.0.0.1:1,127.0.0.2:2");
  CHECK(four.uri == "ipv4:127.0.0.1:1,127.0.0.2:2");
  CHECK(four.balanced);
  CHECK(four.authority == "127.0.0.1");
  CHECK(targetOf("[::1]:1,[::1]:2").uri == "ipv6:[::1]:1,[::1]:2");
  const auto named = targetOf("localhost:7,127.0.0.2:8");
  CHECK(named.uri == "ipv4:127.0.0.1:7,127.0.0.2:8");
  CHECK(named.authority == "localhost");
}

TEST_CASE("A replica that cannot be is named", "[client]") {
  CHECK_THROWS_WITH(targetOf("127.0.0.1:1,no.such.host.invalid:2"),
                    "--server: \"no.such.host.invalid:2\" cannot be found");
  CHECK_THROWS_WITH(targetOf("127.0.0.1:1,[::1]:2"), Catch::Contains("some only IPv6"));
  CHECK_THROWS_WITH(targetOf("127.0.0.1:1,127.0.0.1"), "--server: \"127.0.0.1\" is not host:port");
  CHECK_THROWS_WITH(targetOf("127.0.0.1:1,"), "--server: \"\" is not host:port");
}

TEST_CASE("A token stays on this machine only when every replica does", "[client]") {
  CHECK(staysHere("127.0.0.1:1,localhost:2,unix:/run/s"));
  for (const auto* server : {"127.0.0.1:1,192.0.2.1:2", "localhost:1,shapes.example:2", "127.example.org:1", ""}) {
    INFO(server);
    CHECK_FALSE(staysHere(server));
  }
  ConnectionOptions options;
  options.server = "127.0.0.1:1,192.0.2.1:2";
  options.token = "secret";
  CHECK_THROWS_AS(connect(options), InvalidInput);
}

TEST_CASE("The service configs for other languages are ours", "[client]") {
  const std::string folder = SHAPED_SOURCE "/deploy/load-balancing/";
  std::ifstream several(folder + "round_robin.json"), one(folder + "behind_a_balancer.json");
  CHECK(nlohmann::json::parse(serviceConfig(true)) == nlohmann::json::parse(several));
  CHECK(nlohmann::json::parse(serviceConfig(false)) == nlohmann::json::parse(one));
}
