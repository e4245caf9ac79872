#include "client/load/generator.h"

#include <catch2/catch.hpp>

#include "core/numerics/error.h"
#include "tests/support/daemon.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace std::chrono_literals;

namespace {

client::LoadCall limitsCall() {
  return {.method = "/shaped.v1.Server/GetLimits", .requests = {grpc::ByteBuffer(nullptr, 0)}};
}

client::LoadOptions brief() {
  client::LoadOptions options;
  options.concurrency = 8;
  options.duration = 300ms;
  options.call.timeout = 60s;
  return options;
}

std::uint64_t failures(const client::LoadAccount& account) { return account.sent() - account.answered(); }

}  // namespace

TEST_CASE("every arrival of the schedule is sent or counted as unsent") {
  const test::TestDaemon daemon;
  auto options = brief();
  options.rate = 1000;
  options.arrivals = client::Arrivals::Kind::kFixed;
  const auto account = client::generateLoad({daemon.channel(), daemon.channel()}, limitsCall(), options);
  CHECK(account.sent() + account.unsent() == 300);
  CHECK(account.answered() > 0);
  CHECK(failures(account) == 0);
  CHECK(account.delay().count() == account.sent());
}

TEST_CASE("a load without a rate keeps its places busy") {
  const test::TestDaemon daemon;
  const auto account = client::generateLoad({daemon.channel()}, limitsCall(), brief());
  CHECK(account.answered() > 8);
  CHECK(failures(account) == 0);
  CHECK(account.unsent() == 0);
}

TEST_CASE("errors of the daemon end up in the books with their reasons") {
  const test::TestDaemon daemon;
  const grpc::Slice cat(
      "\x0a\x05\x0a\x03"
      "cat");
  client::LoadCall call{.method = "/shaped.v1.Models/Get", .requests = {grpc::ByteBuffer(&cat, 1)}};
  CHECK_THROWS_AS(client::tryOnce(daemon.channel(), call, {}), client::RpcError);
  const auto account = client::generateLoad({daemon.channel()}, call, brief());
  REQUIRE(account.errors().size() == 1);
  CHECK(account.errors().begin()->first == std::pair(grpc::NOT_FOUND, std::string("MODEL_NOT_FOUND")));
  CHECK(account.errors().begin()->second == account.sent());
  CHECK(account.answered() == 0);
}

TEST_CASE("streams are loaded too, and end when the daemon breaks them off") {
  const test::TestDaemon daemon;
  // A dataset's frame where its header should be, then a thousand more: the answer comes while they are being sent.
  const grpc::Slice frame(std::string("\x12\x00", 2));
  client::LoadCall call{.method = "/shaped.v1.Datasets/Upload", .requests = {}, .streams = true};
  for (int i = 0; i < 1000; ++i) call.requests.emplace_back(&frame, 1);
  const auto account = client::generateLoad({daemon.channel()}, call, brief());
  REQUIRE(account.errors().size() == 1);
  CHECK(account.errors().begin()->first.first == grpc::INVALID_ARGUMENT);
}

TEST_CASE("a stop ends a load and cancels what is in flight") {
  const test::TestDaemon daemon;
  std::stop_source stop;
  auto options = brief();
  options.duration = 1h;
  options.call.stop = stop.get_token();
  options.progress = [&](double) { stop.request_stop(); };
  const auto begin = std::chrono::steady_clock::now();
  const auto account = client::generateLoad({daemon.channel()}, limitsCall(), options);
  CHECK(std::chrono::steady_clock::now() - begin < 60s);
  CHECK(account.sent() > 0);
}

TEST_CASE("options of a load are checked") {
  const test::TestDaemon daemon;
  auto options = brief();
  options.concurrency = 0;
  CHECK_THROWS_AS(client::generateLoad({daemon.channel()}, limitsCall(), options), InvalidInput);
  options = brief();
  options.duration = 0s;
  CHECK_THROWS_AS(client::generateLoad({daemon.channel()}, limitsCall(), options), InvalidInput);
}

TEST_CASE("no daemon, no load") {
  client::ConnectionOptions nowhere;
  nowhere.server = "127.0.0.1:1";
  const auto channel = client::connect(nowhere);
  CHECK_THROWS_AS(client::connectAll({channel}, {}), client::RpcError);
}
