#pragma once

#include <string>

namespace shaped::server {

/// A name that is also a safe folder name. Throws InvalidInput naming `field` unless it is 1 to 100 letters, digits,
/// '.',
/// '_' and '-' that begin with a letter or a digit.
void requireName(const std::string& name, const std::string& field);

}  // namespace shaped::server
