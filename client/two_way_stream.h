#pragma once

#include <grpcpp/support/sync_stream.h>

#include <exception>
#include <thread>

#include "client/connection.h"

namespace shaped::client {

/// Sends requests from a thread of its own and hears the answers meanwhile. write(send): gives every message to `send`,
/// which is false once the daemon has ended the stream and wants no more. answer(response): hears each, in order, on
/// the caller's thread. What either throws breaks the call off and is thrown here. Throws RpcError.
template <class Request, class Response, class Write, class Answer>
void converse(Call& call, grpc::ClientReaderWriterInterface<Request, Response>& stream, const Write& write,
              const Answer& answer) {
  std::exception_ptr failure;  // of the sender, read once it has ended
  std::thread sender([&] {
    try {
      write([&stream](const Request& message) { return stream.Write(message); });
      stream.WritesDone();
    } catch (...) {
      failure = std::current_exception();
      call.context()->TryCancel();
    }
  });
  try {
    for (Response response; stream.Read(&response);) answer(response);
  } catch (...) {
    call.context()->TryCancel();
    sender.join();
    stream.Finish();
    throw;
  }
  sender.join();
  const auto status = stream.Finish();
  if (failure) std::rethrow_exception(failure);
  require(status);
}

/// The commonest conversation: a setup, then `count` frames, made one after the other by frame(index).
template <class Request, class Response, class Setup, class Frame, class Answer>
void converse(Call& call, grpc::ClientReaderWriterInterface<Request, Response>& stream, const Setup& setup,
              std::int64_t count, const Frame& frame, const Answer& answer) {
  const auto write = [&](const auto& send) {
    Request message;
    *message.mutable_setup() = setup;
    bool open = send(message);
    for (std::int64_t i = 0; i < count && open; ++i) {
      *message.mutable_frame() = frame(i);
      open = send(message);
    }
  };
  converse(call, stream, write, answer);
}

}  // namespace shaped::client
