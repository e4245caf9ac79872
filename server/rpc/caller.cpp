#include "server/rpc/caller.h"

#include <grpc/grpc_security_constants.h>

#include "core/numerics/error.h"

namespace shaped::server {
namespace {

/// For the log and for fairness: before the call came here, server/security/transport.cpp let it through by the same
/// credentials.
Credentials credentialsOf(const grpc::CallbackServerContext& context) {
  Credentials credentials;
  const auto& metadata = context.client_metadata();
  if (const auto found = metadata.find("authorization"); found != metadata.end())
    credentials.authorization = {found->second.data(), found->second.size()};
  if (const auto peer = context.auth_context())
    for (const auto& name : peer->FindPropertyValues(GRPC_X509_CN_PROPERTY_NAME))
      credentials.common_name = {name.data(), name.size()};
  return credentials;
}

}  // namespace

std::string nameOfCaller(const Access* access, const grpc::CallbackServerContext& context) {
  return access ? access->nameOf(credentialsOf(context)) : "";
}

bool callerHolds(const Access* access, const grpc::CallbackServerContext& context, Role role) {
  return !access || access->holds(credentialsOf(context), role);
}

std::string hostOf(std::string_view peer) {
  const bool by_port = peer.starts_with("ipv4:") || peer.starts_with("ipv6:");
  return std::string(by_port ? peer.substr(0, peer.rfind(':')) : peer);
}

std::string clientKey(const std::string& name, const std::string& peer) {
  return name.empty() ? hostOf(peer) : "name:" + name;
}

Priority priorityOf(const std::vector<std::string_view>& values) {
  if (values.empty()) return Priority::kNormal;
  if (values.size() > 1) throw InvalidInput(kPriorityKey, "stands in the metadata more than once");
  const auto priority = priorityNamed(values.front());
  if (!priority)
    throw InvalidInput(kPriorityKey, "\"" + std::string(values.front().substr(0, 40)) +
                                         "\" is no priority; use interactive, normal or batch");
  return *priority;
}

Priority priorityOf(const grpc::CallbackServerContext& context) {
  std::vector<std::string_view> values;
  const auto [first, end] = context.client_metadata().equal_range(kPriorityKey);
  for (auto value = first; value != end; ++value) values.emplace_back(value->second.data(), value->second.size());
  return priorityOf(values);
}

}  // namespace shaped::server
