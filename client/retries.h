#pragma once

#include <grpcpp/support/channel_arguments.h>

#include <string>

namespace shaped::client {

/// gRPC's service config of a channel, JSON: calls that change nothing are tried up to four times, a fraction of a
/// second apart, where the answer is UNAVAILABLE: a daemon that died, stopped or cannot be reached. Balanced: the
/// addresses of the target take calls in turn, those whose health says SERVING.
std::string serviceConfig(bool balanced);

/// Sets it, and keeps requests until their answer begins, so that large ones can be sent again too.
void retryIdempotentCalls(grpc::ChannelArguments& arguments, bool balanced);

}  // namespace shaped::client
