#pragma once

#include <string>

namespace shaped::shapectl {

/// The token to call with: the first line of the file, or of SHAPED_TOKEN where no file is named; empty when there is
/// neither. Never from the command line, which every user of the machine can read. Throws InvalidInput naming the
/// source when it is no token.
std::string tokenOf(const std::string& file);

}  // namespace shaped::shapectl
