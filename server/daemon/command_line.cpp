#include "server/daemon/command_line.h"

#include <algorithm>

#include "core/numerics/error.h"
#include "server/daemon/config_file.h"

namespace shaped::server {
namespace {

using Action = CommandLine::Action;

constexpr const char* kConfig = "config";

std::optional<Action> actionOf(const std::string& word) {
  if (word == "--help" || word == "-h") return Action::kHelp;
  if (word == "--version") return Action::kVersion;
  if (word == "--check") return Action::kCheck;
  return std::nullopt;
}

/// "--name=value", or "--name" with the value in the next word, which is then taken too.
GivenOption optionAt(const std::vector<std::string>& words, std::size_t& at) {
  const auto& word = words[at];
  const auto equals = word.find('=');
  const auto name = word.substr(0, equals);
  if (!name.starts_with("--")) throw InvalidInput(word, "is no option of shaped; see shaped --help");
  if (equals == std::string::npos && at + 1 == words.size()) throw InvalidInput(name, "wants a value");
  return {name, name.substr(2), equals == std::string::npos ? words[++at] : word.substr(equals + 1)};
}

std::string line(const std::string& flag, const std::string& help) {
  constexpr std::size_t column = 26;
  return "  " + flag + std::string(flag.size() < column ? column - flag.size() : 1, ' ') + help + "\n";
}

}  // namespace

CommandLine parseCommandLine(const std::vector<std::string>& words, int default_threads) {
  CommandLine command;
  std::vector<GivenOption> given;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (const auto action = actionOf(words[i])) {
      command.action = *action;
      if (action != Action::kCheck) return command;
      continue;
    }
    auto option = optionAt(words, i);
    if (option.name == kConfig && option.value.empty()) throw InvalidInput(option.where, "wants a file");
    if (option.name == kConfig)
      command.config = std::filesystem::absolute(option.value);
    else
      given.push_back(std::move(option));
  }
  command.options.threads = default_threads;
  if (command.config) setOptions(readConfigFile(*command.config), command.options);
  setOptions(given, command.options);
  if (command.options.store.empty()) throw InvalidInput("--store", "is missing: name a folder for models and datasets");
  return command;
}

std::string usage() {
  const DaemonOptions defaults;
  std::string text = "shaped --store DIR [options]: serves shape models over gRPC\n";
  for (const auto& spec : optionSpecs()) {
    const auto value = spec.name == "threads" ? "" : spec.show(defaults);
    text += line("--" + spec.name + " " + spec.value_name, spec.help + (value.empty() ? "" : " (" + value + ")"));
  }
  return text + line("--config FILE", "YAML file of these options, named without the dashes; the command line wins") +
         line("--check", "says whether options and files are in order, and ends") + line("--version", "") +
         "SIGTERM and SIGINT stop it: health turns NOT_SERVING, it answers for the drain time, then running calls get\n"
         "the grace time; a second signal skips the rest of a wait. SIGHUP reads the configuration file again.\n";
}

std::string describe(const DaemonOptions& options) {
  std::string text;
  for (const auto& spec : optionSpecs()) text += spec.name + ": " + spec.show(options) + "\n";
  return text;
}

}  // namespace shaped::server
