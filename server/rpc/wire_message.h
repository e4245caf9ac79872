#pragma once

#include <google/protobuf/message.h>
#include <grpcpp/impl/codegen/proto_utils.h>

#include <concepts>

namespace shaped::server {

/// Notes in a message that the bytes it was to be read from are none of its kind.
void markMalformed(google::protobuf::Message& message);

/// Throws InvalidInput when that is so.
void requireWellFormed(const google::protobuf::Message& message);

}  // namespace shaped::server

namespace grpc {

/// How a request is read from the wire. gRPC's own way answers bytes that are no such message before a handler hears
/// of them: with UNIMPLEMENTED and no text, and in a stream as if the client had ended it. Here the message arrives,
/// marked, and the call is refused in the manner of all wrong requests. Included before any service (call.h).
/// The second argument is gRPC's own to the letter, so that the constraint decides between the two.
template <class T>
requires std::derived_from<T, google::protobuf::Message>
class SerializationTraits<T, typename std::enable_if<std::is_base_of<grpc::protobuf::MessageLite, T>::value>::type> {
 public:
  static Status Serialize(const protobuf::MessageLite& message, ByteBuffer* buffer, bool* own_buffer) {
    return GenericSerialize<ProtoBufferWriter, T>(message, buffer, own_buffer);
  }
  static Status Deserialize(ByteBuffer* buffer, T* request) {
    if (!GenericDeserialize<ProtoBufferReader, T>(buffer, request).ok()) {
      if (buffer) buffer->Clear();
      shaped::server::markMalformed(*request);
    }
    return Status::OK;
  }
};

}  // namespace grpc
