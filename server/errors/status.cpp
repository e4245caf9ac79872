#include "server/errors/status.h"

#include <algorithm>
#include <new>
#include <system_error>

#include "core/io/file_error.h"
#include "core/io/model_directory.h"
#include "core/numerics/error.h"
#include "server/errors/errors.h"

namespace shaped::server {
namespace {

// Jobs take minutes, and a lock has been waited for already: no use in asking sooner.
constexpr std::chrono::seconds kBusyDelay(10);

ErrorReport stoppedReport(StopReason reason) {
  if (reason == StopReason::kDeadline)
    return {
        grpc::DEADLINE_EXCEEDED, "the deadline passed before there was an answer", Reason::kDeadlineExceeded, {}, {}};
  const auto text = reason == StopReason::kReader
                        ? "given up: the client did not take the stream's messages (--write-patience)"
                        : "cancelled by the client";
  return {grpc::CANCELLED, text, Reason::kCancelled, {}, {}};
}

// What server/jobs/sqlite.cpp says; the database's library gives no number of the system's.
constexpr const char* kReadOnlyDatabase = "the file or its file system is read-only";

bool saysOneOf(std::initializer_list<int> reasons, const std::string& text) {
  return std::any_of(reasons.begin(), reasons.end(), [&](int reason) {
    return text.find(std::generic_category().message(reason)) != std::string::npos;
  });
}

ErrorReport fileReport(const std::string& text) {
  if (saysDiskFull(text))
    return {grpc::RESOURCE_EXHAUSTED, text + "; free space in the store and try again", Reason::kDiskFull, {}, {}};
  if (saysReadOnly(text))
    return {grpc::UNAVAILABLE, text + "; its operator must make it writable", Reason::kStoreReadOnly, {}, kBusyDelay};
  return {grpc::INTERNAL, text, Reason::kFileFailure, {}, {}};
}

ErrorReport reportOf(const std::exception_ptr& error, StopReason stopped) {
  try {
    std::rethrow_exception(error);
  } catch (const Stopped&) {
    return stoppedReport(stopped);
  } catch (const ModelNotFound& problem) {
    return {grpc::NOT_FOUND, problem.what(), Reason::kModelNotFound, {}, {}};
  } catch (const InvalidInput& problem) {
    return {grpc::INVALID_ARGUMENT, problem.what(), Reason::kInvalidField, problem.field(), {}};
  } catch (const NotFound& problem) {
    return {grpc::NOT_FOUND, problem.what(), Reason::kNotFound, {}, {}};
  } catch (const AlreadyExists& problem) {
    return {grpc::ALREADY_EXISTS, problem.what(), Reason::kAlreadyExists, {}, {}};
  } catch (const Busy& problem) {
    return {grpc::RESOURCE_EXHAUSTED, problem.what(), Reason::kTooManyJobs, {}, kBusyDelay};
  } catch (const StoreLocked& problem) {
    return {grpc::UNAVAILABLE, problem.what(), Reason::kStoreLocked, {}, kBusyDelay};
  } catch (const WrongState& problem) {
    return {grpc::FAILED_PRECONDITION, problem.what(), Reason::kWrongState, {}, {}};
  } catch (const NotAllowed& problem) {
    return {grpc::PERMISSION_DENIED, problem.what(), Reason::kNotAllowed, {}, {}};
  } catch (const OverBudget& problem) {
    ErrorReport report{grpc::RESOURCE_EXHAUSTED, problem.what(), Reason::kMemoryBudget, {}, {}};
    if (problem.mayPass()) report.retry_after = std::chrono::seconds(1);
    return report;
  } catch (const Corrupted& problem) {
    return {grpc::DATA_LOSS, problem.what(), Reason::kDataDamaged, {}, {}};
  } catch (const FileError& problem) {
    return fileReport(problem.what());
  } catch (const std::system_error& problem) {
    return fileReport(problem.what());
  } catch (const std::bad_alloc&) {
    return {grpc::RESOURCE_EXHAUSTED, "not enough memory for this request", Reason::kOutOfMemory, {}, {}};
  } catch (const std::exception& problem) {
    return {grpc::INTERNAL, problem.what(), Reason::kInternal, {}, {}};
  } catch (...) {
    return {grpc::INTERNAL, "an unknown error", Reason::kInternal, {}, {}};
  }
}

}  // namespace

bool saysDiskFull(const std::string& text) { return saysOneOf({ENOSPC, EDQUOT, EFBIG}, text); }

bool saysReadOnly(const std::string& text) {
  return saysOneOf({EROFS, EACCES, EPERM}, text) || text.find(kReadOnlyDatabase) != std::string::npos;
}

grpc::Status statusOf(const std::exception_ptr& error, StopReason stopped) {
  return statusOf(reportOf(error, stopped));
}

std::optional<RefusalCause> refusalCauseOf(const std::exception_ptr& error) {
  const auto diskFull = [](const std::exception& problem) {
    return saysDiskFull(problem.what()) ? std::optional(RefusalCause::kDisk) : std::nullopt;
  };
  try {
    std::rethrow_exception(error);
  } catch (const Busy&) {
    return RefusalCause::kWaitingJobs;
  } catch (const StoreLocked&) {
    return RefusalCause::kStoreLock;
  } catch (const std::bad_alloc&) {
    return RefusalCause::kMemory;
  } catch (const FileError& problem) {
    return diskFull(problem);
  } catch (const std::system_error& problem) {
    return diskFull(problem);
  } catch (...) {
    return std::nullopt;
  }
}

grpc::Status stoppedStatus(StopReason reason) { return statusOf(stoppedReport(reason)); }

std::string nameOf(grpc::StatusCode code) {
  switch (code) {
    case grpc::OK:
      return "OK";
    case grpc::CANCELLED:
      return "CANCELLED";
    case grpc::INVALID_ARGUMENT:
      return "INVALID_ARGUMENT";
    case grpc::DEADLINE_EXCEEDED:
      return "DEADLINE_EXCEEDED";
    case grpc::NOT_FOUND:
      return "NOT_FOUND";
    case grpc::ALREADY_EXISTS:
      return "ALREADY_EXISTS";
    case grpc::PERMISSION_DENIED:
      return "PERMISSION_DENIED";
    case grpc::UNAUTHENTICATED:
      return "UNAUTHENTICATED";
    case grpc::RESOURCE_EXHAUSTED:
      return "RESOURCE_EXHAUSTED";
    case grpc::FAILED_PRECONDITION:
      return "FAILED_PRECONDITION";
    case grpc::UNAVAILABLE:
      return "UNAVAILABLE";
    case grpc::DATA_LOSS:
      return "DATA_LOSS";
    case grpc::INTERNAL:
      return "INTERNAL";
    default:
      return "UNKNOWN";
  }
}

bool serversFault(grpc::StatusCode code) {
  return code == grpc::INTERNAL || code == grpc::DATA_LOSS || code == grpc::UNKNOWN;
}

}  // namespace shaped::server
