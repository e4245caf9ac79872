#pragma once

#include <grpcpp/support/status.h>

#include <chrono>
#include <optional>
#include <string>

#include "server/scheduling/refusal.h"

namespace shaped::server {

/// Why a request was not served, for programs: the `reason` of google.rpc.ErrorInfo. Part of the API (docs/api.md):
/// names never change.
enum class Reason {
  kInvalidField,      ///< the request itself is wrong; google.rpc.BadRequest names the field
  kModelNotFound,     ///< no such model or version
  kNotFound,          ///< no such dataset or job
  kAlreadyExists,     ///< the name holds something else
  kWrongState,        ///< not possible as things stand, whatever the request says
  kServerBusy,        ///< refused at the door: too many requests wait; google.rpc.RetryInfo says when to come back
  kBytesInFlight,     ///< likewise: the messages of all requests are too large together
  kOpenStreams,       ///< likewise: too many streams are open
  kClientRequests,    ///< likewise: too many requests of this client are in flight
  kClientBytes,       ///< likewise: their messages are too large together
  kClientStreams,     ///< likewise: too many streams of this client are open
  kTooManyJobs,       ///< too many jobs wait
  kStoreLocked,       ///< another program keeps a file of the store locked
  kMemoryBudget,      ///< a model does not fit into the memory budget
  kDiskFull,          ///< no room in the store
  kOutOfMemory,       ///< no memory for this request
  kDataDamaged,       ///< a file of the store does not hold what was written to it
  kFileFailure,       ///< the store cannot be read or written
  kStoreReadOnly,     ///< the store's disk, or its files, may not be written to
  kNotAllowed,        ///< the caller's roles do not go so far
  kDeadlineExceeded,  ///< the client's deadline or the server's cap passed
  kCancelled,         ///< the client cancelled or went away
  kInternal,          ///< a defect of the server
};
/// "INVALID_FIELD" and so on.
std::string nameOf(Reason reason);
/// Of a refusal.
Reason reasonOf(RefusalCause cause);

/// Everything that is told of a failure.
struct ErrorReport {
  grpc::StatusCode code = grpc::INTERNAL;
  std::string message;
  Reason reason = Reason::kInternal;
  std::string field;  ///< path in the request; empty where no field is at fault
  std::optional<std::chrono::milliseconds> retry_after;
};

/// The status as it goes over the wire: code and message, and as details a google.rpc.Status with ErrorInfo, and
/// BadRequest and RetryInfo where they apply. Texts are cut so that it fits gRPC's header limit of 8 KiB.
grpc::Status statusOf(const ErrorReport& report);

}  // namespace shaped::server
