#pragma once

#include <grpcpp/server_builder.h>

namespace shaped::server {

/// Bounds what a single client and a dead one can hold: the connection's settings, each with its reason.
void limitConnections(grpc::ServerBuilder& builder);

/// Lets this process open as many files as the system allows it: connections and the store share them. Returns how
/// many.
std::size_t raiseDescriptorLimit();

}  // namespace shaped::server
