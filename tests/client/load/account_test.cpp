#include "client/load/account.h"

#include <catch2/catch.hpp>

using namespace shaped::client;
using namespace std::chrono_literals;

namespace {

double milliseconds(std::chrono::nanoseconds time) { return std::chrono::duration<double, std::milli>(time).count(); }

CallOutcome answer(std::chrono::nanoseconds intended, std::chrono::nanoseconds sent, std::chrono::nanoseconds ended) {
  return {.intended = intended, .sent = sent, .ended = ended, .sent_bytes = 10, .received_bytes = 1000};
}

CallOutcome failure(std::chrono::nanoseconds sent, std::chrono::nanoseconds ended, grpc::StatusCode code,
                    const std::string& reason) {
  return {.intended = sent, .sent = sent, .ended = ended, .code = code, .reason = reason};
}

}  // namespace

TEST_CASE("latency counts from when a call was due, service time from when it was sent") {
  LoadAccount account(0s, 10s, 50ms);
  account.record(answer(100ms, 100ms, 110ms));
  account.record(answer(200ms, 500ms, 510ms));  // sent late: the daemon was quick, and the client waited all the same
  CHECK(milliseconds(account.latency().max()) == 310);
  CHECK(milliseconds(account.service().max()) == 10);
  CHECK(milliseconds(account.delay().max()) == 300);
  CHECK(account.late() == 1);
  CHECK(account.answered() == 2);
  CHECK(account.good() == 1);
}

TEST_CASE("without a deadline every answer is good") {
  LoadAccount account(0s, 10s, std::nullopt);
  account.record(answer(0s, 9s, 10s));
  CHECK(account.good() == 1);
}

TEST_CASE("errors are counted by code and reason, and refusals have their times apart") {
  LoadAccount account(0s, 10s, 1s);
  account.record(failure(1s, 1s + 2ms, grpc::RESOURCE_EXHAUSTED, "SERVER_BUSY"));
  account.record(failure(1s, 1s + 4ms, grpc::RESOURCE_EXHAUSTED, "SERVER_BUSY"));
  account.record(failure(1s, 1s + 6ms, grpc::RESOURCE_EXHAUSTED, ""));
  account.record(failure(1s, 2s, grpc::DEADLINE_EXCEEDED, "DEADLINE_EXCEEDED"));
  CHECK(account.errors() == LoadAccount::Errors{{{grpc::RESOURCE_EXHAUSTED, "SERVER_BUSY"}, 2},
                                                {{grpc::RESOURCE_EXHAUSTED, ""}, 1},
                                                {{grpc::DEADLINE_EXCEEDED, "DEADLINE_EXCEEDED"}, 1}});
  CHECK(account.sent() == 4);
  CHECK(account.answered() == 0);
  CHECK(account.latency().count() == 0);
  CHECK(account.refusals().count() == 3);
  CHECK(milliseconds(account.refusals().max()) == 6);
}

TEST_CASE("the warm-up is not counted, by when a call was due") {
  LoadAccount account(2s, 8s, std::nullopt);
  account.record(answer(1999ms, 2100ms, 2200ms));
  account.recordUnsent(1s);
  CHECK(account.sent() == 0);
  CHECK(account.unsent() == 0);
  CHECK(account.receivedBytesPerSecond() == 0);
  account.record(answer(2s, 2s, 2100ms));
  account.recordUnsent(3s);
  CHECK(account.sent() == 1);
  CHECK(account.unsent() == 1);
}

TEST_CASE("rates divide by the whole time until the last answer") {
  LoadAccount account(2s, 8s, 1s);
  for (int i = 0; i < 16; ++i) account.record(answer(2s + i * 500ms, 2s + i * 500ms, 2s + i * 500ms + 10ms));
  CHECK(account.seconds() == Approx(8));
  CHECK(account.answersPerSecond() == Approx(2));
  CHECK(account.sentBytesPerSecond() == Approx(20));
  CHECK(account.receivedBytesPerSecond() == Approx(2000));
  // A backlog that is answered after the end must not look like a higher rate.
  account.record(answer(9s, 9s, 18s));
  CHECK(account.seconds() == Approx(16));
  CHECK(account.answersPerSecond() == Approx(17.0 / 16));
  CHECK(account.goodPerSecond() == Approx(1));
}
