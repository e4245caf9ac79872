#include "server/daemon/options.h"

#include <functional>
#include <map>

#include "core/io/text_scanner.h"
#include "core/numerics/error.h"

namespace shaped::server {
namespace {

double numberOf(const std::string& option, const std::string& text, double least, double most) {
  double value = 0;
  if (!parseNumber(text, value) || !(value >= least && value <= most))
    throw InvalidInput(option, "\"" + text + "\", want a number from " + shortest(least) + " to " + shortest(most));
  return value;
}

std::size_t countOf(const std::string& option, const std::string& text, std::int64_t most) {
  std::int64_t value = 0;
  if (!parseInteger(text, value) || value < 1 || value > most)
    throw InvalidInput(option, "\"" + text + "\", want a whole number from 1 to " + std::to_string(most));
  return static_cast<std::size_t>(value);
}

using Setter = std::function<void(DaemonOptions&, const std::string& option, const std::string& value)>;

const std::map<std::string, Setter>& setters() {
  static const std::map<std::string, Setter> table{
      {"--listen", [](auto& options, auto&, auto& value) { options.listen = value; }},
      {"--store", [](auto& options, auto&, auto& value) { options.store = value; }},
      {"--threads",
       [](auto& options, auto& name, auto& value) { options.threads = static_cast<int>(countOf(name, value, 1024)); }},
      {"--longest-call",
       [](auto& options, auto& name, auto& value) { options.longest_call = numberOf(name, value, 0.001, 1e6); }},
      {"--publish-patience",
       [](auto& options, auto& name, auto& value) { options.publish_patience = numberOf(name, value, 0, 1e6); }},
      {"--queue-length",
       [](auto& options, auto& name, auto& value) { options.limits.queue_length = countOf(name, value, 1 << 20); }},
      {"--queue-megabytes", [](auto& options, auto& name,
                               auto& value) { options.limits.queue_bytes = countOf(name, value, 1 << 20) << 20; }},
      {"--open-streams",
       [](auto& options, auto& name, auto& value) { options.limits.open_streams = countOf(name, value, 1 << 20); }},
      {"--log", [](auto& options, auto&, auto& value) { options.log = value; }},
  };
  return table;
}

}  // namespace

std::optional<DaemonOptions> parseOptions(const std::vector<std::string>& words, int default_threads) {
  DaemonOptions options;
  options.threads = default_threads;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i] == "--help" || words[i] == "-h") return std::nullopt;
    const auto equals = words[i].find('=');
    const auto name = words[i].substr(0, equals);
    const auto setter = setters().find(name);
    if (setter == setters().end()) throw InvalidInput(words[i], "is no option of shaped; see shaped --help");
    if (equals == std::string::npos && i + 1 == words.size()) throw InvalidInput(name, "wants a value");
    setter->second(options, name, equals == std::string::npos ? words[++i] : words[i].substr(equals + 1));
  }
  if (options.store.empty()) throw InvalidInput("--store", "is missing: name a folder for models and datasets");
  return options;
}

std::string usage() {
  return "shaped --store DIR [options]: serves shape models over gRPC\n"
         "  --listen HOST:PORT    address to serve on, port 0 for any free one (127.0.0.1:50051); unix:PATH works too\n"
         "  --store DIR           folder of models and datasets, made when missing\n"
         "  --threads N           solver threads, and threads of the training job (all processors)\n"
         "  --longest-call S      cap on a call, and on a stream's time between messages [s] (600)\n"
         "  --publish-patience S  how long a trained model waits for room on a full disk [s] (300)\n"
         "  --queue-length N      requests that may wait for a solver thread (256)\n"
         "  --queue-megabytes N   their messages together (512)\n"
         "  --open-streams N      streams at a time (64)\n"
         "  --log LEVEL           debug, info, warn or error, to stderr (info)\n"
         "SIGTERM and SIGINT stop it: no new calls, training jobs cancelled, running calls get 5 seconds.\n";
}

}  // namespace shaped::server
