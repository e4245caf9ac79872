#pragma once

#include <google/protobuf/message.h>

#include "tests/fuzz/fuzz.h"

namespace shaped::fuzz {

/// The message that the bytes encode; bytes that encode none are skipped, as gRPC does before any converter.
template <class Message>
std::optional<Message> parsed(std::string_view bytes) {
  Message message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return std::nullopt;
  return message;
}

/// Changes one field somewhere in the message: a number to another or to a peculiar one, an entry added, removed or
/// doubled, a part set or cleared.
void mutate(google::protobuf::Message& message, unsigned seed);

}  // namespace shaped::fuzz

/// FUZZ_WIRE_TARGET(name, Message): as FUZZ_TARGET, for inputs that encode a message; half of the fuzzer's changes are
/// to its fields, half to its bytes.
#ifdef SHAPED_FUZZ
extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);
#define FUZZ_WIRE_TARGET(name, Message)                                                                  \
  extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, \
                                                 unsigned seed) {                                        \
    auto message = shaped::fuzz::parsed<Message>({reinterpret_cast<const char*>(data), size});           \
    if (!message || seed % 2 == 0) return LLVMFuzzerMutate(data, size, most);                            \
    shaped::fuzz::mutate(*message, seed / 2);                                                            \
    if (message->ByteSizeLong() > most) return LLVMFuzzerMutate(data, size, most);                       \
    message->SerializeToArray(data, static_cast<int>(most));                                             \
    return message->ByteSizeLong();                                                                      \
  }                                                                                                      \
  FUZZ_TARGET(name)
#else
#define FUZZ_WIRE_TARGET(name, Message) FUZZ_TARGET(name)
#endif
