#include "server/rpc/wire_message.h"

#include <catch2/catch.hpp>

#include "core/numerics/error.h"
#include "shaped/v1/models.pb.h"
#include "shaped/v1/shapes.pb.h"

using namespace shaped;

namespace {

template <class Message>
grpc::Status read(const std::string& bytes, Message& message) {
  const grpc::Slice slice(bytes);
  grpc::ByteBuffer buffer(&slice, 1);
  return grpc::SerializationTraits<Message>::Deserialize(&buffer, &message);
}

}  // namespace

TEST_CASE("bytes that are no message arrive as one that is refused") {
  // A length beyond the end, an endless group, a text that is no UTF-8, tag 0, a truncated number.
  using namespace std::string_literals;
  for (const auto& bytes : {"\x0a\x7f cut"s, "\x0b"s, "\x0a\x04\x0a\x02\xff\xfe"s, "\0"s, "\x10\xff"s}) {
    v1::GetModelRequest request;
    request.set_with_mean(true);
    REQUIRE(read(bytes, request).ok());
    CHECK_FALSE(request.with_mean());  // nothing of what could be read, or was there before, is left
    CHECK_THROWS_WITH(server::requireWellFormed(request), Catch::Contains("message: is no shaped.v1.GetModelRequest"));
  }
  v1::GetModelRequest none;
  REQUIRE(grpc::SerializationTraits<v1::GetModelRequest>::Deserialize(nullptr, &none).ok());
  CHECK_THROWS_AS(server::requireWellFormed(none), InvalidInput);
}

TEST_CASE("messages arrive as they were sent, with fields that are not known yet too") {
  v1::GetModelRequest sent, received;
  sent.mutable_model()->set_name("cat");
  sent.set_with_mean(true);
  REQUIRE(read(sent.SerializeAsString() + "\xa8\x3f\x01", received).ok());  // field 1013 = 1
  CHECK(received.model().name() == "cat");
  CHECK(received.with_mean());
  CHECK_NOTHROW(server::requireWellFormed(received));
  v1::GetModelRequest empty;
  REQUIRE(read("", empty).ok());
  CHECK_NOTHROW(server::requireWellFormed(empty));
}

TEST_CASE("a message is written as gRPC writes it") {
  v1::ProjectRequest sent, received;
  for (int i = 0; i < 100'000; ++i) sent.mutable_shape()->add_positions(static_cast<float>(i));
  grpc::ByteBuffer buffer;
  bool own = false;
  REQUIRE(grpc::SerializationTraits<v1::ProjectRequest>::Serialize(sent, &buffer, &own).ok());
  CHECK(buffer.Length() == sent.ByteSizeLong());
  REQUIRE(grpc::SerializationTraits<v1::ProjectRequest>::Deserialize(&buffer, &received).ok());
  CHECK(received.SerializeAsString() == sent.SerializeAsString());
}
