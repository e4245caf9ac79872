#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "core/numerics/error.h"

namespace shaped::fuzz {

/// A reader accepted what it should have refused, or what it read does not survive being written.
class Broken : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

/// Throws Broken with the promise that was not kept.
inline void require(bool kept, const char* promise) {
  if (!kept) throw Broken(promise);
}

/// What `read` returns, or nothing when it refuses its input with an exception that it documents. Any other exception
/// is a finding and passes through.
template <class Documented, class Read>
auto accepted(Read&& read) -> std::optional<decltype(read())> {
  try {
    return read();
  } catch (const Documented&) {
    return std::nullopt;
  }
}

/// This process's folder for files of one input after the other; in memory when TMPDIR is. Removed at exit.
const std::filesystem::path& scratchFolder();

/// Writes a file of these bytes into the scratch folder and returns its path.
std::filesystem::path scratchFile(std::string_view name, std::string_view bytes);

using Target = void (*)(std::string_view bytes);

/// Makes a target known to the replay program by its name.
struct Registration {
  Registration(const char* name, Target target);
};

}  // namespace shaped::fuzz

/// FUZZ_TARGET(name) { ... }: what to do with one input, `bytes`. It returns, or it has found something.
#ifdef SHAPED_FUZZ
#define FUZZ_TARGET(name)                                                             \
  static void name##Target(std::string_view bytes);                                   \
  extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) { \
    name##Target({reinterpret_cast<const char*>(data), size});                        \
    return 0;                                                                         \
  }                                                                                   \
  static void name##Target(std::string_view bytes)
#else
#define FUZZ_TARGET(name)                                                          \
  static void name##Target(std::string_view bytes);                                \
  static const shaped::fuzz::Registration name##Registration(#name, name##Target); \
  static void name##Target(std::string_view bytes)
#endif
