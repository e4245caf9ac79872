#include "server/security/token_table.h"

#include <google/protobuf/util/time_util.h>
#include <openssl/crypto.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/io/sha256.h"
#include "core/numerics/error.h"

namespace shaped::server {
namespace {

using nlohmann::json;

constexpr std::size_t kDigits = 64;  // of a SHA-256

bool isHash(const std::string& text) {
  const auto isDigit = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
  return text.size() == kDigits && std::all_of(text.begin(), text.end(), isDigit);
}

void requireKeys(const json& object, const std::string& field, const std::vector<std::string>& known) {
  if (!object.is_object()) throw InvalidInput(field, "must be a JSON object");
  for (const auto& [key, value] : object.items())
    if (std::find(known.begin(), known.end(), key) == known.end())
      throw InvalidInput(field, "\"" + key + "\" is no key that is known here");
}

std::string textAt(const json& object, const std::string& key, const std::string& field) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_string() || found->get_ref<const std::string&>().empty())
    throw InvalidInput(field + "." + key, "must be there, a text that is not empty");
  return *found;
}

Roles rolesOf(const json& list, const std::string& field) {
  if (!list.is_array() || list.empty()) throw InvalidInput(field, "must be a list of roles, at least one");
  Roles roles;
  for (const auto& entry : list) {
    const auto role = entry.is_string() ? roleNamed(entry.get_ref<const std::string&>()) : std::nullopt;
    if (!role) throw InvalidInput(field, entry.dump() + " is no role; use \"read\", \"infer\", \"train\", \"admin\"");
    roles.add(*role);
  }
  return roles;
}

std::chrono::system_clock::time_point timeOf(const json& value, const std::string& field) {
  google::protobuf::Timestamp time;
  if (!value.is_string() || !google::protobuf::util::TimeUtil::FromString(value.get<std::string>(), &time))
    throw InvalidInput(field, value.dump() + " is no time; write it as \"2027-01-31T00:00:00Z\"");
  return std::chrono::system_clock::time_point(std::chrono::seconds(time.seconds()));
}

Client clientOf(const json& entry, const std::string& field) {
  Client client{textAt(entry, "name", field), rolesOf(entry.value("roles", json()), field + ".roles"), {}};
  if (entry.contains("expires")) client.expires = timeOf(entry["expires"], field + ".expires");
  return client;
}

json parsed(const std::string& text) {
  try {
    return json::parse(text);
  } catch (const json::exception&) {
    // The library's own message quotes the text, and with it perhaps a hash.
    throw InvalidInput("", "is no JSON document");
  }
}

}  // namespace

TokenTable::TokenTable(const std::string& text) {
  const auto document = parsed(text);
  requireKeys(document, "the document", {"tokens", "certificates"});
  const auto entries = document.value("tokens", json::array());
  if (!entries.is_array()) throw InvalidInput("tokens", "must be a list");
  for (const auto& entry : entries) {
    const auto field = "tokens[" + std::to_string(tokens_.size()) + "]";
    requireKeys(entry, field, {"name", "sha256", "roles", "expires"});
    Token token{textAt(entry, "sha256", field), clientOf(entry, field)};
    if (!isHash(token.sha256))
      throw InvalidInput(field + ".sha256", "must be the token's SHA-256 as 64 lower-case hexadecimal digits");
    for (const auto& other : tokens_) {
      if (other.client.name == token.client.name)
        throw InvalidInput(field + ".name", "\"" + token.client.name + "\" is there twice");
      if (other.sha256 == token.sha256)
        throw InvalidInput(field + ".sha256", "is that of \"" + other.client.name + "\" too");
    }
    tokens_.push_back(std::move(token));
  }
  const auto names = document.value("certificates", json::object());
  if (!names.is_object()) throw InvalidInput("certificates", "must be an object of common names and their roles");
  for (const auto& [name, roles] : names.items())
    certificates_.emplace(name, Client{name, rolesOf(roles, "certificates." + name), {}});
}

const Client* TokenTable::byToken(std::string_view token) const {
  const auto hash = sha256(token);
  const Client* found = nullptr;
  for (const auto& entry : tokens_)
    if (CRYPTO_memcmp(entry.sha256.data(), hash.data(), kDigits) == 0) found = &entry.client;
  return found;
}

const Client* TokenTable::byCertificate(std::string_view common_name) const {
  const auto found = certificates_.find(common_name);
  return found == certificates_.end() ? nullptr : &found->second;
}

}  // namespace shaped::server
