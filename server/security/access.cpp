#include "server/security/access.h"

namespace shaped::server {
namespace {

constexpr char kUnknown[] =
    "this daemon serves known clients only: the token is missing, unknown or expired; send the metadata "
    "\"authorization: Bearer TOKEN\" (shapectl: --token-file FILE, or SHAPED_TOKEN)";

/// The token of "Bearer TOKEN"; the scheme's case does not matter (RFC 9110). Nothing for another scheme.
std::optional<std::string_view> bearerToken(std::string_view authorization) {
  constexpr std::string_view scheme = "bearer ";
  if (authorization.size() <= scheme.size()) return std::nullopt;
  for (std::size_t i = 0; i < scheme.size(); ++i)
    if ((authorization[i] | 0x20) != scheme[i]) return std::nullopt;
  return authorization.substr(scheme.size());
}

/// "/shaped.v1.Models/List" as people say it: "Models.List".
std::string shortName(std::string_view method) {
  constexpr std::string_view package = "/shaped.v1.";
  if (!method.starts_with(package)) return std::string(method);
  std::string name(method.substr(package.size()));
  if (const auto slash = name.find('/'); slash != std::string::npos) name[slash] = '.';
  return name;
}

}  // namespace

void Access::use(TokenTable table) {
  auto shared = std::make_shared<const TokenTable>(std::move(table));
  const std::scoped_lock lock(mutex_);
  table_ = std::move(shared);
}

std::optional<Client> Access::clientOf(const Credentials& credentials) const {
  std::shared_ptr<const TokenTable> table;
  {
    const std::scoped_lock lock(mutex_);
    table = table_;
  }
  const std::string common_name(credentials.common_name);
  if (!table) return Client{common_name, Roles::all(), {}};
  const Client* found = nullptr;
  if (!credentials.authorization.empty()) {
    const auto token = bearerToken(credentials.authorization);
    found = token ? table->byToken(*token) : nullptr;
  } else if (!common_name.empty()) {
    found = table->byCertificate(common_name);
  }
  if (!found || found->expired(std::chrono::system_clock::now())) return std::nullopt;
  return *found;
}

grpc::Status Access::judge(std::string_view method, const Credentials& credentials) const {
  auto status = verdict(method, credentials);
  if (status.error_code() == grpc::UNAUTHENTICATED) ++unauthenticated_;
  if (status.error_code() == grpc::PERMISSION_DENIED) ++denied_;
  return status;
}

grpc::Status Access::verdict(std::string_view method, const Credentials& credentials) const {
  using Who = Requirement::Who;
  const auto requirement = requirementOf(method);
  if (requirement.who == Who::kEverybody) return grpc::Status::OK;
  const auto client = clientOf(credentials);
  if (!client) return {grpc::UNAUTHENTICATED, kUnknown};
  if (requirement.who == Who::kClients) return grpc::Status::OK;
  if (requirement.who == Who::kNobody)
    return {grpc::PERMISSION_DENIED, shortName(method) + " is no method that a role allows"};
  std::string wanted;
  for (const auto role : requirement.roles) {
    if (client->roles.holds(role)) return grpc::Status::OK;
    wanted += (wanted.empty() ? "\"" : " or \"") + server::nameOf(role) + "\"";
  }
  return {grpc::PERMISSION_DENIED, shortName(method) + " needs the role " + wanted + ", which \"" + client->name +
                                       "\" does not have; ask the operator for it"};
}

bool Access::holds(const Credentials& credentials, Role role) const {
  const auto client = clientOf(credentials);
  return client && client->roles.holds(role);
}

std::map<grpc::StatusCode, std::uint64_t> Access::denials() const {
  return {{grpc::UNAUTHENTICATED, unauthenticated_}, {grpc::PERMISSION_DENIED, denied_}};
}

std::string Access::nameOf(const Credentials& credentials) const {
  const auto client = clientOf(credentials);
  return client ? client->name : "";
}

}  // namespace shaped::server
