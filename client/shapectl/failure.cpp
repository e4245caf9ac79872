#include "client/shapectl/failure.h"

#include <iostream>
#include <nlohmann/json.hpp>

#include "client/diagnosis.h"
#include "core/numerics/error.h"

namespace shaped::shapectl {
namespace {

constexpr const char* nameOf(ExitCode code) {
  switch (code) {
    case ExitCode::kSuccess:
      return "success";
    case ExitCode::kInternal:
      return "internal";
    case ExitCode::kBadInput:
      return "bad_input";
    case ExitCode::kNotFound:
      return "not_found";
    case ExitCode::kUnavailable:
      return "unavailable";
    case ExitCode::kDeadline:
      return "deadline";
    case ExitCode::kCancelled:
      return "cancelled";
    case ExitCode::kNotConverged:
      return "not_converged";
    case ExitCode::kDenied:
      return "denied";
  }
  return "internal";
}

/// What the daemon told for programs.
nlohmann::json detailsOf(const client::RpcError& error) {
  nlohmann::json details = nlohmann::json::object();
  if (!error.reason().empty()) details["reason"] = error.reason();
  if (!error.field().empty()) details["field"] = error.field();
  if (const auto delay = error.retryAfter())
    details["retry_after_seconds"] = 1e-3 * static_cast<double>(delay->count());
  return details;
}

ExitCode report(const Session& session, ExitCode code, const std::string& message,
                nlohmann::json details = nlohmann::json::object()) {
  if (session.json) {
    details["kind"] = nameOf(code);
    details["message"] = message;
    std::cout << nlohmann::json{{"error", details}}.dump(2, ' ', false, nlohmann::json::error_handler_t::replace)
              << "\n";
  } else
    std::cerr << "shapectl: " << message << "\n";
  return code;
}

std::string unreachable(const Session& session, const client::RpcError& error) {
  const auto& server = session.connection.server;
  const auto reason = client::diagnose(session.connection);
  if (!reason.empty()) return server + ": " + reason;
  return "no daemon answers at " + server + " (" + error.what() + "); start shaped or name another with --server";
}

}  // namespace

ExitCode exitCodeOf(grpc::StatusCode code) {
  switch (code) {
    case grpc::OK:
      return ExitCode::kSuccess;
    case grpc::INVALID_ARGUMENT:
    case grpc::OUT_OF_RANGE:
    case grpc::ALREADY_EXISTS:
    case grpc::FAILED_PRECONDITION:
      return ExitCode::kBadInput;
    case grpc::NOT_FOUND:
      return ExitCode::kNotFound;
    case grpc::UNAVAILABLE:
    case grpc::RESOURCE_EXHAUSTED:
      return ExitCode::kUnavailable;
    case grpc::DEADLINE_EXCEEDED:
      return ExitCode::kDeadline;
    case grpc::CANCELLED:
      return ExitCode::kCancelled;
    case grpc::UNAUTHENTICATED:
    case grpc::PERMISSION_DENIED:
      return ExitCode::kDenied;
    default:
      return ExitCode::kInternal;
  }
}

ExitCode reportingFailures(const Session& session, const std::function<ExitCode()>& verb) {
  try {
    return verb();
  } catch (const InvalidInput& error) {
    return report(session, ExitCode::kBadInput, error.what());
  } catch (const client::RpcError& error) {
    if (session.stop.stop_requested()) return report(session, ExitCode::kCancelled, "cancelled");
    const auto code = exitCodeOf(error.code());
    return report(session, code, error.code() == grpc::UNAVAILABLE ? unreachable(session, error) : error.what(),
                  detailsOf(error));
  } catch (const std::exception& error) {
    return report(session, ExitCode::kInternal, error.what());
  }
}

}  // namespace shaped::shapectl
