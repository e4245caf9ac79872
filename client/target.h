#pragma once

#include <string>
#include <vector>

namespace shaped::client {

/// Where a channel connects to, in gRPC's words.
struct Target {
  std::string uri;        ///< "dns:///host:port", "ipv4:1.2.3.4:5,1.2.3.6:5", ...
  bool balanced;          ///< there may be several addresses, which take calls in turn
  std::string authority;  ///< whose certificate each address must show; empty: the host that the uri names
};

/// The parts between commas: "a:1,b:2" names two replicas of one daemon.
std::vector<std::string> replicasOf(const std::string& server);

/// Reads --server: host:port, any gRPC target, or several host:port with commas between. Several are looked up here and
/// now, and each must show a certificate for the first one's host; "dns:///host:port" is looked up again and again, and
/// all its addresses are used. Throws InvalidInput naming the one that cannot be found, or when they have no family of
/// addresses in common.
Target targetOf(const std::string& server);

/// Whether what is sent there does not leave this machine; of several, all of it.
bool staysHere(const std::string& server);

}  // namespace shaped::client
