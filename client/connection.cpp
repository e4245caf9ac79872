#include "client/connection.h"

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/channel_arguments.h>

namespace shaped::client {
namespace {

constexpr int kLargestMessage = 64 << 20;  // as the daemon's: a shape of five million vertices

}  // namespace

void require(const grpc::Status& status) {
  if (!status.ok()) throw RpcError(status);
}

std::shared_ptr<grpc::Channel> connect(const std::string& server) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kLargestMessage);
  arguments.SetMaxSendMessageSize(kLargestMessage);
  return grpc::CreateCustomChannel(server, grpc::InsecureChannelCredentials(), arguments);
}

Call::Call(const CallOptions& options) : on_stop_(options.stop, [this] { context_.TryCancel(); }) {
  if (options.timeout)
    context_.set_deadline(std::chrono::system_clock::now() +
                          std::chrono::duration_cast<std::chrono::system_clock::duration>(*options.timeout));
}

}  // namespace shaped::client
