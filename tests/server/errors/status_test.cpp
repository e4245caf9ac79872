#include "server/errors/status.h"

#include <catch2/catch.hpp>
#include <new>
#include <system_error>

#include "core/io/file_error.h"
#include "core/numerics/error.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "server/errors/errors.h"

using namespace shaped;
using namespace shaped::server;

namespace {

template <class Error>
grpc::Status statusFor(const Error& error, StopReason reason = StopReason::kNone) {
  return statusOf(std::make_exception_ptr(error), reason);
}

/// What a client unpacks.
struct Details {
  google::rpc::ErrorInfo info;
  google::rpc::BadRequest request;
  google::rpc::RetryInfo retry;
  bool has_retry = false;
};

Details detailsOf(const grpc::Status& status) {
  google::rpc::Status message;
  REQUIRE(message.ParseFromString(status.error_details()));
  CHECK(message.code() == status.error_code());
  CHECK(message.message() == status.error_message());
  Details details;
  for (const auto& detail : message.details()) {
    detail.UnpackTo(&details.info);
    detail.UnpackTo(&details.request);
    details.has_retry |= detail.UnpackTo(&details.retry);
  }
  return details;
}

}  // namespace

TEST_CASE("every kind of failure has its status") {
  CHECK(statusFor(InvalidInput("faces[3]", "is bad")).error_code() == grpc::INVALID_ARGUMENT);
  CHECK(statusFor(InvalidInput("faces[3]", "is bad")).error_message() == "faces[3]: is bad");
  CHECK(statusFor(NotFound("x")).error_code() == grpc::NOT_FOUND);
  CHECK(statusFor(AlreadyExists("x")).error_code() == grpc::ALREADY_EXISTS);
  CHECK(statusFor(Busy("x")).error_code() == grpc::RESOURCE_EXHAUSTED);
  CHECK(statusFor(StoreLocked("x")).error_code() == grpc::UNAVAILABLE);
  CHECK(statusFor(Corrupted("x")).error_code() == grpc::DATA_LOSS);
  CHECK(statusFor(std::bad_alloc()).error_code() == grpc::RESOURCE_EXHAUSTED);
  CHECK(statusFor(std::runtime_error("x")).error_code() == grpc::INTERNAL);
  CHECK(statusFor(7).error_code() == grpc::INTERNAL);
}

TEST_CASE("a full disk is a resource, one that may not be written to the operator's, another failure internal") {
  const auto reason = [](int code) { return std::generic_category().message(code); };
  CHECK(statusFor(FileError("m", "cannot be written: " + reason(ENOSPC))).error_code() == grpc::RESOURCE_EXHAUSTED);
  CHECK(statusFor(FileError("m", "cannot be written: " + reason(EIO))).error_code() == grpc::INTERNAL);
  CHECK(statusFor(std::system_error(ENOSPC, std::generic_category())).error_code() == grpc::RESOURCE_EXHAUSTED);
  CHECK(statusFor(std::system_error(EIO, std::generic_category())).error_code() == grpc::INTERNAL);
  for (const int code : {EROFS, EACCES, EPERM})
    CHECK(statusFor(std::system_error(code, std::generic_category())).error_code() == grpc::UNAVAILABLE);
  CHECK(
      statusFor(FileError("jobs.sqlite", "cannot be written: the file or its file system is read-only")).error_code() ==
      grpc::UNAVAILABLE);
}

TEST_CASE("what was turned away for want of something says of what") {
  const auto cause = [](const auto& error) { return refusalCauseOf(std::make_exception_ptr(error)); };
  CHECK(cause(Busy("x")) == RefusalCause::kWaitingJobs);
  CHECK(cause(StoreLocked("x")) == RefusalCause::kStoreLock);
  CHECK(cause(std::bad_alloc()) == RefusalCause::kMemory);
  CHECK(cause(FileError("m", std::generic_category().message(ENOSPC))) == RefusalCause::kDisk);
  CHECK(cause(std::system_error(EDQUOT, std::generic_category())) == RefusalCause::kDisk);
  CHECK_FALSE(cause(FileError("m", std::generic_category().message(EIO))).has_value());
  CHECK_FALSE(cause(InvalidInput("faces[3]", "is bad")).has_value());
  CHECK_FALSE(cause(7).has_value());
}

TEST_CASE("a stop says who did it") {
  CHECK(statusFor(Stopped(), StopReason::kClient).error_code() == grpc::CANCELLED);
  CHECK(statusFor(Stopped(), StopReason::kDeadline).error_code() == grpc::DEADLINE_EXCEEDED);
}

TEST_CASE("a status carries its details for programs") {
  const auto details = detailsOf(statusFor(InvalidInput("faces[3]", "is bad")));
  CHECK(details.info.reason() == "INVALID_FIELD");
  CHECK(details.info.domain() == "shaped");
  REQUIRE(details.request.field_violations_size() == 1);
  CHECK(details.request.field_violations(0).field() == "faces[3]");
  CHECK(details.request.field_violations(0).description() == "faces[3]: is bad");
  CHECK_FALSE(details.has_retry);

  const auto busy = detailsOf(statusOf(
      ErrorReport{grpc::RESOURCE_EXHAUSTED, "busy", Reason::kServerBusy, {}, std::chrono::milliseconds(2250)}));
  CHECK(busy.info.reason() == "SERVER_BUSY");
  REQUIRE(busy.has_retry);
  CHECK(busy.retry.retry_delay().seconds() == 2);
  CHECK(busy.retry.retry_delay().nanos() == 250'000'000);
  CHECK(busy.request.field_violations_size() == 0);
}

TEST_CASE("a status fits gRPC's header limit, whatever a client wrote") {
  for (const std::string letter : {"x", "\xC3\xA9", "\xE2\x82\xAC", "\xFF"}) {
    std::string text;
    for (int i = 0; i < 50000; ++i) text += letter;
    const auto status = statusFor(InvalidInput(text, text));
    // every byte of the message may be percent-encoded, the details are in base64
    CHECK(3 * status.error_message().size() + 4 * status.error_details().size() / 3 < 7500);
    CHECK(detailsOf(status).info.reason() == "INVALID_FIELD");
  }
}
