#pragma once

#include <grpcpp/completion_queue.h>
#include <grpcpp/generic/generic_stub.h>

#include <functional>
#include <memory>

#include "client/load/generator.h"

namespace shaped::client {

/// One call on its way, driven by the events of a completion queue. It owns itself from start() to its end.
class Flight {
 public:
  /// Hears of the end once. The outcome's times are for the caller to fill in.
  using Landed = std::function<void(CallOutcome, const grpc::Status&)>;

  virtual ~Flight() = default;
  /// Sends it. call and queue must outlive it.
  static void start(grpc::GenericStub& stub, const LoadCall& call, const CallOptions& options,
                    grpc::CompletionQueue& queue, Landed landed);
  /// Takes an event from the queue to the flight that it belongs to.
  static void deliver(void* tag, bool ok);

 protected:
  /// The address of one is what the queue hands back.
  struct Tag {
    Flight* flight;
    void (Flight::*handler)(bool ok);
  };

  Flight(const LoadCall& call, const CallOptions& options, Landed landed)
      : call_(call), context_(options), landed_(std::move(landed)) {}
  void land(const grpc::Status& status);

  const LoadCall& call_;
  Call context_;
  CallOutcome outcome_;

 private:
  Landed landed_;
};

}  // namespace shaped::client
