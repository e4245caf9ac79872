#pragma once

#include <grpcpp/support/status.h>

#include <exception>
#include <optional>
#include <string>

#include "server/errors/report.h"
#include "server/scheduling/refusal.h"
#include "server/scheduling/stopper.h"

namespace shaped::server {

/// The status for an exception that ended a request, with its details; the one place where this is decided.
///   ModelNotFound, NotFound -> NOT_FOUND
///   any other InvalidInput -> INVALID_ARGUMENT; text and details name the field
///   AlreadyExists -> ALREADY_EXISTS
///   WrongState -> FAILED_PRECONDITION
///   Busy, OverBudget, std::bad_alloc -> RESOURCE_EXHAUSTED
///   StoreLocked -> UNAVAILABLE
///   Corrupted -> DATA_LOSS
///   Stopped -> see stoppedStatus
///   NotAllowed -> PERMISSION_DENIED
///   FileError, std::system_error -> RESOURCE_EXHAUSTED when the disk is full, UNAVAILABLE when it may not be written
///   to, else INTERNAL anything else -> INTERNAL
grpc::Status statusOf(const std::exception_ptr& error, StopReason stopped);

/// The client went away or reads nothing: CANCELLED; time is up: DEADLINE_EXCEEDED.
grpc::Status stoppedStatus(StopReason reason);

/// Why the request was turned away although nothing was wrong with it; nothing for any other exception.
std::optional<RefusalCause> refusalCauseOf(const std::exception_ptr& error);

/// Whether a FileError's text gives a full disk, quota or size limit as the system's reason.
bool saysDiskFull(const std::string& text);

/// Whether it gives a disk or a file that may not be written to.
bool saysReadOnly(const std::string& text);

/// "INVALID_ARGUMENT" and so on.
std::string nameOf(grpc::StatusCode code);

/// Whether an operator should look: the server, not the client, is at fault.
bool serversFault(grpc::StatusCode code);

}  // namespace shaped::server
