#pragma once

#include <string>
#include <vector>

#include "core/bootstrap/bootstrap_report.h"

namespace shaped {

/// Reports as JSON text, numbers to the last bit; of names that are not UTF-8 the bytes that are not are replaced.
std::string textOf(const std::vector<BootstrapScan>& scans);
std::string textOf(const std::vector<BootstrapRound>& rounds);

/// The other way. Throw InvalidInput naming what is missing or of another type.
std::vector<BootstrapScan> scansFrom(const std::string& text);
std::vector<BootstrapRound> roundsFrom(const std::string& text);

}  // namespace shaped
