#include "server/errors/report.h"

#include <array>
#include <nlohmann/json.hpp>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"

namespace shaped::server {
namespace {

constexpr std::array kNames{"INVALID_FIELD",     "MODEL_NOT_FOUND", "NOT_FOUND",    "ALREADY_EXISTS",  "WRONG_STATE",
                            "SERVER_BUSY",       "BYTES_IN_FLIGHT", "OPEN_STREAMS", "CLIENT_REQUESTS", "CLIENT_BYTES",
                            "CLIENT_STREAMS",    "TOO_MANY_JOBS",   "STORE_LOCKED", "MEMORY_BUDGET",   "DISK_FULL",
                            "OUT_OF_MEMORY",     "DATA_DAMAGED",    "FILE_FAILURE", "STORE_READ_ONLY", "NOT_ALLOWED",
                            "DEADLINE_EXCEEDED", "CANCELLED",       "INTERNAL"};
static_assert(kNames.size() == static_cast<std::size_t>(Reason::kInternal) + 1);

/// Text that a protobuf field may hold: what is no UTF-8 is replaced.
std::string asUtf8(const std::string& text) {
  using nlohmann::json;
  return json::parse(json(text).dump(-1, ' ', false, json::error_handler_t::replace)).get<std::string>();
}

// gRPC cuts what exceeds its limit together with the whole status. The message goes out twice, and may grow threefold
// by percent encoding.
std::string shortened(const std::string& text, std::size_t longest) {
  const auto valid = asUtf8(text);
  return valid.size() <= longest ? valid : asUtf8(valid.substr(0, longest)) + " ...";
}

}  // namespace

std::string nameOf(Reason reason) { return kNames.at(static_cast<std::size_t>(reason)); }

Reason reasonOf(RefusalCause cause) {
  switch (cause) {
    case RefusalCause::kQueueLength:
    case RefusalCause::kDeadline:
      return Reason::kServerBusy;
    case RefusalCause::kBytesInFlight:
      return Reason::kBytesInFlight;
    case RefusalCause::kOpenStreams:
      return Reason::kOpenStreams;
    case RefusalCause::kClientRequests:
      return Reason::kClientRequests;
    case RefusalCause::kClientBytes:
      return Reason::kClientBytes;
    case RefusalCause::kClientStreams:
      return Reason::kClientStreams;
    case RefusalCause::kWaitingJobs:
      return Reason::kTooManyJobs;
    case RefusalCause::kStoreLock:
      return Reason::kStoreLocked;
    case RefusalCause::kMemory:
      return Reason::kOutOfMemory;
    case RefusalCause::kDisk:
      return Reason::kDiskFull;
  }
  return Reason::kInternal;
}

grpc::Status statusOf(const ErrorReport& report) {
  const auto message = shortened(report.message, 1000);
  google::rpc::Status status;
  status.set_code(report.code);
  status.set_message(message);
  google::rpc::ErrorInfo info;
  info.set_reason(nameOf(report.reason));
  info.set_domain("shaped");
  status.add_details()->PackFrom(info);
  if (!report.field.empty()) {
    google::rpc::BadRequest request;
    auto& violation = *request.add_field_violations();
    violation.set_field(shortened(report.field, 200));
    violation.set_description(message);
    status.add_details()->PackFrom(request);
  }
  if (report.retry_after) {
    google::rpc::RetryInfo retry;
    retry.mutable_retry_delay()->set_seconds(report.retry_after->count() / 1000);
    retry.mutable_retry_delay()->set_nanos(static_cast<std::int32_t>(report.retry_after->count() % 1000 * 1'000'000));
    status.add_details()->PackFrom(retry);
  }
  return {report.code, message, status.SerializeAsString()};
}

}  // namespace shaped::server
