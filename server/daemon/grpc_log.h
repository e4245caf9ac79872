#pragma once

namespace shaped::server {

/// Lets gRPC's own messages appear in the daemon's log, as warnings: mostly handshakes that clients have spoilt.
void takeGrpcLog();

}  // namespace shaped::server
