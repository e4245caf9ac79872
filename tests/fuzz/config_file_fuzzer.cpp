#include "server/daemon/config_file.h"
#include "tests/fuzz/fuzz.h"

using namespace shaped;
using namespace shaped::fuzz;

FUZZ_TARGET(config_file) {
  const auto file = scratchFile("shaped.yaml", bytes);
  const auto given = accepted<InvalidInput>([&] { return server::readConfigFile(file); });
  if (!given) return;
  server::DaemonOptions options;
  accepted<InvalidInput>([&] { return server::setOptions(*given, options), true; });
  require(options.threads >= 1 && options.longest_call > 0, "options stay in range");
}
