#pragma once

#include <grpcpp/server_context.h>

#include <optional>
#include <string>
#include <string_view>

#include "server/scheduling/request_queue.h"
#include "server/security/access.h"

namespace shaped::server {

/// The metadata by which a client says how urgent a call is: "interactive", "normal" or "batch".
inline constexpr char kPriorityKey[] = "shaped-priority";

/// Who makes a call: the name of its token or certificate; empty where nobody is asked or nothing is known.
/// access: null where nobody is asked.
std::string nameOfCaller(const Access* access, const grpc::CallbackServerContext& context);

/// Whether he may do what needs this role; everybody may where nobody is asked.
bool callerHolds(const Access* access, const grpc::CallbackServerContext& context, Role role);

/// Where a connection comes from without what changes from one to the next: "ipv4:10.0.0.7:53012" is "ipv4:10.0.0.7".
std::string hostOf(std::string_view peer);

/// By whom scheduling tells clients apart: their name, or their host where they have none. No host is any name.
std::string clientKey(const std::string& name, const std::string& peer);

/// Of the metadata's values for kPriorityKey; normal when there is none. Throws InvalidInput naming the key when there
/// are several, or one that means nothing.
Priority priorityOf(const std::vector<std::string_view>& values);
/// As above, of a call's metadata.
Priority priorityOf(const grpc::CallbackServerContext& context);

}  // namespace shaped::server
