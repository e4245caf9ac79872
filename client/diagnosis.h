#pragma once

#include <string>

#include "client/connection.h"

namespace shaped::client {

/// Why no connection comes about, where the machine is reached but TLS fails: gRPC says no more than that it does.
/// Tries the handshake once more, with nothing but the handshake, for at most a few seconds. Names the cure; empty when
/// the handshake is not what fails.
std::string diagnose(const ConnectionOptions& options);

}  // namespace shaped::client
