#include "server/security/limits.h"

#include <sys/resource.h>

namespace shaped::server {

void limitConnections(grpc::ServerBuilder& builder) {
  constexpr int second = 1000, minute = 60 * second;
  // A machine that was switched off says nothing: ask every minute, and close after 20 s without an answer.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, minute);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 20 * second);
  // Clients behind a NAT ask too, also between calls, to keep it open; more often than every 10 s is abuse.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 10 * second);
  // Connections without calls cost memory and a descriptor each. Channels connect again by themselves at the next call.
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_IDLE_MS, 15 * minute);
  // A client must show its certificate anew now and then, and reaches a machine that was added behind a balancer.
  // Calls that run go on, however long: there is no grace period that ends them.
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_MS, 60 * minute);
  // As HTTP/2 recommends. Beyond it a client's calls wait on the client's side.
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, 100);
  // A token has some 50 bytes; proxies and traces add a few hundred.
  builder.AddChannelArgument(GRPC_ARG_MAX_METADATA_SIZE, 16 << 10);
  // Who connects and does not greet, in TLS or HTTP/2, is closed.
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, 20 * second);
}

std::size_t raiseDescriptorLimit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return 0;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
  getrlimit(RLIMIT_NOFILE, &limit);
  return limit.rlim_cur;
}

}  // namespace shaped::server
