#include "client/load/flight.h"

namespace shaped::client {
namespace {

class UnaryFlight final : public Flight {
 public:
  UnaryFlight(grpc::GenericStub& stub, const LoadCall& call, const CallOptions& options, grpc::CompletionQueue& queue,
              Landed landed)
      : Flight(call, options, std::move(landed)),
        reader_(stub.PrepareUnaryCall(context_.context(), call.method, call.requests.front(), &queue)) {
    outcome_.sent_bytes = call.requests.front().Length();
  }

  void go() {
    reader_->StartCall();
    reader_->Finish(&response_, &status_, &finished_);
  }

 private:
  void onFinished(bool) {
    outcome_.received_bytes = response_.Length();
    land(status_);
  }

  std::unique_ptr<grpc::ClientAsyncResponseReader<grpc::ByteBuffer>> reader_;
  grpc::ByteBuffer response_;
  grpc::Status status_;
  Tag finished_{this, static_cast<void (Flight::*)(bool)>(&UnaryFlight::onFinished)};
};

/// Sends its messages as fast as they are taken and reads the answers meanwhile.
class StreamFlight final : public Flight {
 public:
  StreamFlight(grpc::GenericStub& stub, const LoadCall& call, const CallOptions& options, grpc::CompletionQueue& queue,
               Landed landed)
      : Flight(call, options, std::move(landed)), stream_(stub.PrepareCall(context_.context(), call.method, &queue)) {}

  void go() { stream_->StartCall(&started_); }

 private:
  void onStarted(bool ok) {
    if (!ok) return finish();
    write();
    stream_->Read(&response_, &read_);
  }

  void write() {
    const auto& request = call_.requests[next_++];
    outcome_.sent_bytes += request.Length();
    writing_ = true;
    next_ == call_.requests.size() ? stream_->WriteLast(request, {}, &written_) : stream_->Write(request, &written_);
  }

  void onWritten(bool ok) {
    writing_ = false;
    // A write that fails means that the daemon has ended the stream: the reader hears why.
    if (ok && next_ < call_.requests.size()) return write();
    landWhenAllIsOver();
  }

  void onRead(bool ok) {
    if (!ok) return finish();
    outcome_.received_bytes += response_.Length();
    stream_->Read(&response_, &read_);
  }

  void finish() { stream_->Finish(&status_, &finished_); }

  void onFinished(bool) {
    over_ = true;
    landWhenAllIsOver();
  }

  void landWhenAllIsOver() {
    if (over_ && !writing_) land(status_);
  }

  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> stream_;
  grpc::ByteBuffer response_;
  grpc::Status status_;
  std::size_t next_ = 0;
  bool writing_ = false, over_ = false;
  Tag started_{this, static_cast<void (Flight::*)(bool)>(&StreamFlight::onStarted)};
  Tag written_{this, static_cast<void (Flight::*)(bool)>(&StreamFlight::onWritten)};
  Tag read_{this, static_cast<void (Flight::*)(bool)>(&StreamFlight::onRead)};
  Tag finished_{this, static_cast<void (Flight::*)(bool)>(&StreamFlight::onFinished)};
};

}  // namespace

void Flight::start(grpc::GenericStub& stub, const LoadCall& call, const CallOptions& options,
                   grpc::CompletionQueue& queue, Landed landed) {
  // Each deletes itself when it lands: the queue holds the only pointers to it.
  if (call.streams)
    (new StreamFlight(stub, call, options, queue, std::move(landed)))->go();
  else
    (new UnaryFlight(stub, call, options, queue, std::move(landed)))->go();
}

void Flight::deliver(void* tag, bool ok) {
  const auto& event = *static_cast<Tag*>(tag);
  (event.flight->*event.handler)(ok);
}

void Flight::land(const grpc::Status& status) {
  const std::unique_ptr<Flight> self(this);
  outcome_.code = status.error_code();
  if (!status.ok()) outcome_.reason = RpcError(status).reason();
  landed_(std::move(outcome_), status);
}

}  // namespace shaped::client
