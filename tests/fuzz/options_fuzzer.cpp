#include "server/daemon/command_line.h"

#include "tests/fuzz/fuzz.h"

using namespace shaped;
using namespace shaped::fuzz;

namespace {

/// One word a line, as they stand on a command line.
std::vector<std::string> wordsOf(std::string_view bytes) {
  std::vector<std::string> words;
  while (!bytes.empty()) {
    const auto end = std::min(bytes.find('\n'), bytes.size());
    words.emplace_back(bytes.substr(0, end));
    bytes.remove_prefix(std::min(end + 1, bytes.size()));
  }
  return words;
}

}  // namespace

FUZZ_TARGET(options) {
  const auto parsed = accepted<InvalidInput>([&] { return server::parseCommandLine(wordsOf(bytes), 3); });
  if (!parsed || parsed->action == server::CommandLine::Action::kHelp ||
      parsed->action == server::CommandLine::Action::kVersion)
    return;
  const auto& options = parsed->options;
  require(!options.store.empty(), "there is a store");
  require(options.threads >= 1 && options.threads <= 1024, "threads are in range");
  require(options.longest_call > 0 && options.publish_patience >= 0, "times are in range");
  require(options.admission.queue_length >= 1 && options.admission.open_streams >= 1, "limits are at least 1");
  require(options.admission.bytes_in_flight >= 1 << 20, "what is in flight may be a megabyte");
  require(!server::describe(options).empty(), "options can be told");
}
