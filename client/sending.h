#pragma once

#include <grpcpp/support/sync_stream.h>

#include "client/connection.h"

namespace shaped::client {

/// Sends a stream of requests and takes the one answer to them. write(send): gives every message to `send`, which is
/// false once the daemon has answered early and wants no more; what it throws breaks the call off. Throws RpcError.
template <class Request, class Write>
void sendAll(Call& call, grpc::ClientWriter<Request>& writer, const Write& write) {
  try {
    write([&writer](const Request& message) { return writer.Write(message); });
  } catch (...) {
    call.context()->TryCancel();
    writer.Finish();
    throw;
  }
  writer.WritesDone();
  require(writer.Finish());
}

}  // namespace shaped::client
