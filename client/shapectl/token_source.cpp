#include "client/shapectl/token_source.h"

#include <algorithm>
#include <cstdlib>

#include "core/io/file.h"
#include "core/numerics/error.h"

namespace shaped::shapectl {
namespace {

/// gRPC refuses other characters in metadata, with an error that names neither the file nor the place.
std::string checked(const std::string& source, const std::string& text) {
  const auto token = text.substr(0, text.find_first_of("\r\n"));
  const auto printable = [](char c) { return c > ' ' && c <= '~'; };
  if (token.empty() || !std::all_of(token.begin(), token.end(), printable))
    throw InvalidInput(source, "holds no token; want one line of printable characters without spaces");
  return token;
}

}  // namespace

std::string tokenOf(const std::string& file) {
  if (!file.empty()) return checked(file, readFile(file));
  const char* token = std::getenv("SHAPED_TOKEN");
  return token && *token ? checked("SHAPED_TOKEN", token) : "";
}

}  // namespace shaped::shapectl
