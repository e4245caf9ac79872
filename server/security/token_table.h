#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/security/roles.h"

namespace shaped::server {

/// Somebody who calls.
struct Client {
  std::string name;
  Roles roles;
  std::optional<std::chrono::system_clock::time_point> expires;

  bool expired(std::chrono::system_clock::time_point now) const { return expires && *expires <= now; }
};

/// Who is known by which token or certificate: the content of a tokens file, docs/operations.md. Immutable.
class TokenTable {
 public:
  /// Reads the JSON text of a tokens file. Throws InvalidInput that names the entry, what is wrong with it and what
  /// would be accepted; never quotes a hash.
  explicit TokenTable(const std::string& text);

  /// Whom the token belongs to, expired or not; nullptr when nobody. The time it takes does not depend on the token.
  const Client* byToken(std::string_view token) const;
  /// Whom a verified certificate with this subject common name belongs to; nullptr when the file does not name it.
  const Client* byCertificate(std::string_view common_name) const;
  std::size_t size() const { return tokens_.size() + certificates_.size(); }

 private:
  struct Token {
    std::string sha256;  ///< 64 lower-case hexadecimal digits
    Client client;
  };

  std::vector<Token> tokens_;
  std::map<std::string, Client, std::less<>> certificates_;
};

}  // namespace shaped::server
