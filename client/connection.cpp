#include "client/connection.h"

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/channel_arguments.h>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"

namespace shaped::client {

RpcError::RpcError(const grpc::Status& status)
    : std::runtime_error(status.error_message()), code_(status.error_code()) {
  google::rpc::Status details;
  if (!details.ParseFromString(status.error_details())) return;
  for (const auto& detail : details.details()) {
    google::rpc::ErrorInfo info;
    google::rpc::BadRequest request;
    google::rpc::RetryInfo retry;
    if (detail.UnpackTo(&info) && info.domain() == "shaped") reason_ = info.reason();
    if (detail.UnpackTo(&request) && request.field_violations_size() > 0) field_ = request.field_violations(0).field();
    if (detail.UnpackTo(&retry))
      retry_after_ =
          std::chrono::milliseconds(retry.retry_delay().seconds() * 1000 + retry.retry_delay().nanos() / 1'000'000);
  }
}

void require(const grpc::Status& status) {
  if (!status.ok()) throw RpcError(status);
}

std::shared_ptr<grpc::Channel> connect(const std::string& server) {
  grpc::ChannelArguments arguments;
  // The daemon has the limits (Server.GetLimits) and says so when a message is too large.
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetMaxSendMessageSize(-1);
  return grpc::CreateCustomChannel(server, grpc::InsecureChannelCredentials(), arguments);
}

Call::Call(const CallOptions& options) : on_stop_(options.stop, [this] { context_.TryCancel(); }) {
  if (options.timeout)
    context_.set_deadline(std::chrono::system_clock::now() +
                          std::chrono::duration_cast<std::chrono::system_clock::duration>(*options.timeout));
}

}  // namespace shaped::client
