#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <functional>
#include <string>
#include <vector>

#include "client/connection.h"
#include "client/load/account.h"
#include "client/load/arrivals.h"

namespace shaped::client {

/// The call that is made again and again, its messages ready to be sent.
struct LoadCall {
  std::string method;                      ///< "/shaped.v1.Server/GetLimits"
  std::vector<grpc::ByteBuffer> requests;  ///< one message, or those of a stream
  bool streams = false;                    ///< whether either side sends a stream
};

struct LoadOptions {
  std::optional<double> rate;  ///< calls per second; none: each place sends when it is free
  Arrivals::Kind arrivals = Arrivals::Kind::kPoisson;
  std::uint64_t seed = 1;                           ///< of the arrivals
  std::uint32_t concurrency = 100;                  ///< calls in flight at most, >= 1; the others wait, and are late
  std::chrono::nanoseconds warm_up{}, duration{};   ///< measured is what is meant to be sent in the second
  CallOptions call{};                               ///< timeout: of each call, from when it is sent
  std::function<void(double fraction)> progress{};  ///< told some times a second how far it is; may be empty
};

/// Waits until all channels are connected. Throws RpcError (UNAVAILABLE) when one is not after 20 s.
void connectAll(const std::vector<std::shared_ptr<grpc::Channel>>& channels, const std::stop_token& stop);

/// Makes the call once and throws RpcError unless it is answered.
void tryOnce(const std::shared_ptr<grpc::Channel>& channel, const LoadCall& call, const CallOptions& options);

/// Loads a daemon through the channels in turn, and returns when all calls have ended. One thread sends and one hears
/// the answers, however many calls are in flight. On a stop, calls in flight are cancelled and what was measured is
/// returned. Throws InvalidInput naming the option that is out of range.
LoadAccount generateLoad(const std::vector<std::shared_ptr<grpc::Channel>>& channels, const LoadCall& call,
                         const LoadOptions& options);

}  // namespace shaped::client
