#include "server/datasets/name.h"

#include <algorithm>

#include "core/numerics/error.h"

namespace shaped::server {
namespace {

// Not std::isalnum: that depends on the locale.
bool isLetterOrDigit(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9'); }
bool isNameCharacter(char c) { return isLetterOrDigit(c) || c == '.' || c == '_' || c == '-'; }

}  // namespace

void requireName(const std::string& name, const std::string& field) {
  constexpr std::size_t longest = 100;
  if (name.empty() || name.size() > longest || !isLetterOrDigit(name.front()) ||
      !std::all_of(name.begin(), name.end(), isNameCharacter))
    throw InvalidInput(field, "want 1 to 100 letters, digits, '.', '_' and '-', beginning with a letter or a digit");
}

}  // namespace shaped::server
