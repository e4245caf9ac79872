#include "server/rpc/wire_message.h"

#include <google/protobuf/unknown_field_set.h>

#include "core/numerics/error.h"

namespace shaped::server {
namespace {

constexpr int kMark = 536'870'911;  // the largest number that a field can have: none of ours has it

}  // namespace

void markMalformed(google::protobuf::Message& message) {
  message.Clear();
  message.GetReflection()->MutableUnknownFields(&message)->AddVarint(kMark, 0);
}

void requireWellFormed(const google::protobuf::Message& message) {
  const auto& unknown = message.GetReflection()->GetUnknownFields(message);
  if (unknown.field_count() > 0 && unknown.field(0).number() == kMark)
    throw InvalidInput("message", "is no " + message.GetDescriptor()->full_name() +
                                      ": these bytes are not its encoding, or a text in it is not UTF-8");
}

}  // namespace shaped::server
