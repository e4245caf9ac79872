#include "server/errors/status.h"

#include <catch2/catch.hpp>
#include <new>
#include <system_error>

#include "core/io/file_error.h"
#include "core/numerics/error.h"
#include "server/errors/errors.h"

using namespace shaped;
using namespace shaped::server;

namespace {

template <class Error>
grpc::Status statusFor(const Error& error, StopReason reason = StopReason::kNone) {
  return statusOf(std::make_exception_ptr(error), reason);
}

}  // namespace

TEST_CASE("every kind of failure has its status") {
  CHECK(statusFor(InvalidInput("faces[3]", "is bad")).error_code() == grpc::INVALID_ARGUMENT);
  CHECK(statusFor(InvalidInput("faces[3]", "is bad")).error_message() == "faces[3]: is bad");
  CHECK(statusFor(NotFound("x")).error_code() == grpc::NOT_FOUND);
  CHECK(statusFor(AlreadyExists("x")).error_code() == grpc::ALREADY_EXISTS);
  CHECK(statusFor(Busy("x")).error_code() == grpc::RESOURCE_EXHAUSTED);
  CHECK(statusFor(Corrupted("x")).error_code() == grpc::DATA_LOSS);
  CHECK(statusFor(std::bad_alloc()).error_code() == grpc::RESOURCE_EXHAUSTED);
  CHECK(statusFor(std::runtime_error("x")).error_code() == grpc::INTERNAL);
  CHECK(statusFor(7).error_code() == grpc::INTERNAL);
}

TEST_CASE("a full disk is a resource, another disk failure is internal") {
  const auto reason = [](int code) { return std::generic_category().message(code); };
  CHECK(statusFor(FileError("m", "cannot be written: " + reason(ENOSPC))).error_code() == grpc::RESOURCE_EXHAUSTED);
  CHECK(statusFor(FileError("m", "cannot be written: " + reason(EIO))).error_code() == grpc::INTERNAL);
  CHECK(statusFor(std::system_error(ENOSPC, std::generic_category())).error_code() == grpc::RESOURCE_EXHAUSTED);
  CHECK(statusFor(std::system_error(EACCES, std::generic_category())).error_code() == grpc::INTERNAL);
}

TEST_CASE("a stop says who did it") {
  CHECK(statusFor(Stopped(), StopReason::kClient).error_code() == grpc::CANCELLED);
  CHECK(statusFor(Stopped(), StopReason::kDeadline).error_code() == grpc::DEADLINE_EXCEEDED);
}

TEST_CASE("a status fits gRPC's header limit") {
  CHECK(statusFor(InvalidInput("label", std::string(100000, 'x'))).error_message().size() < 4096);
}
