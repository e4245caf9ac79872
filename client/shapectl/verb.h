#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client/shapectl/arguments.h"
#include "client/shapectl/exit_code.h"
#include "client/shapectl/session.h"

namespace shaped::shapectl {

/// One verb of shapectl, whole in its file verbs/<name>.cpp.
///
/// To add one: write `Verb fooVerb()` in verbs/foo.cpp, declare it in verbs/verbs.h, and list it in verbs/verbs.cpp.
/// Its options live in a struct held by a shared pointer that both functions capture. `run` prints its result to stdout
/// through output.h (text or JSON as session.json says), progress through ProgressBar (progress_bar.h), and returns how
/// it went; it reports failure by throwing: InvalidInput (bad input), FileError (this machine), client::RpcError (the
/// daemon). A local verb (no daemon) just does not call session.channel(); long loops poll session.stop.
struct Verb {
  std::string name;
  std::string help;
  std::function<void(Arguments&)> declare;
  std::function<ExitCode(const Session&)> run;
};

/// Makes a Verb of an options struct with `void declare(Arguments&)` and `ExitCode run(const Session&) const`.
template <class Options>
Verb makeVerb(std::string name, std::string help) {
  auto options = std::make_shared<Options>();
  return {std::move(name), std::move(help), [options](Arguments& arguments) { options->declare(arguments); },
          [options](const Session& session) { return options->run(session); }};
}

}  // namespace shaped::shapectl
