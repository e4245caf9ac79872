#include "client/target.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <memory>
#include <sstream>

#include "core/numerics/error.h"

namespace shaped::client {
namespace {

struct HostPort {
  std::string host, port;
};

HostPort hostPortOf(const std::string& replica) {
  const auto colon = replica.rfind(':');
  if (colon == std::string::npos || colon == 0 || colon + 1 == replica.size())
    throw InvalidInput("--server", "\"" + replica + "\" is not host:port");
  auto host = replica.substr(0, colon);
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  return {host, replica.substr(colon + 1)};
}

/// "1.2.3.4:5" for each address of the host in a family; none when it has none there.
std::vector<std::string> addressesOf(const HostPort& place, int family) {
  addrinfo* found = nullptr;
  addrinfo hints{};
  hints.ai_family = family;
  hints.ai_socktype = SOCK_STREAM;
  if (getaddrinfo(place.host.c_str(), place.port.c_str(), &hints, &found) != 0) return {};
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> all(found, &freeaddrinfo);
  std::vector<std::string> addresses;
  for (const auto* each = all.get(); each; each = each->ai_next) {
    std::array<char, NI_MAXHOST> host{};
    std::array<char, NI_MAXSERV> port{};
    if (getnameinfo(each->ai_addr, each->ai_addrlen, host.data(), host.size(), port.data(), port.size(),
                    NI_NUMERICHOST | NI_NUMERICSERV) != 0)
      continue;
    addresses.push_back((family == AF_INET6 ? "[" + std::string(host.data()) + "]" : std::string(host.data())) + ":" +
                        port.data());
  }
  return addresses;
}

/// The addresses of all replicas, with commas between; empty when one has none in the family.
std::string addressList(const std::vector<std::string>& replicas, int family) {
  std::string list;
  for (const auto& replica : replicas) {
    const auto addresses = addressesOf(hostPortOf(replica), family);
    if (addresses.empty()) return "";
    for (const auto& address : addresses) list += (list.empty() ? "" : ",") + address;
  }
  return list;
}

/// Says why the replicas have no addresses of one family.
[[noreturn]] void throwNoAddresses(const std::vector<std::string>& replicas) {
  for (const auto& replica : replicas) {
    const auto place = hostPortOf(replica);
    if (addressesOf(place, AF_INET).empty() && addressesOf(place, AF_INET6).empty())
      throw InvalidInput("--server", "\"" + replica + "\" cannot be found");
  }
  throw InvalidInput("--server", "names replicas of which some have only IPv4 and some only IPv6 addresses");
}

bool replicaStaysHere(const std::string& replica) {
  for (const auto* host : {"localhost:", "[::1]:", "unix:", "unix-abstract:"})
    if (replica.starts_with(host)) return true;
  // Numbers only: 127.example.org is somewhere else.
  return replica.starts_with("127.") && replica.find_first_not_of("0123456789.:") == std::string::npos;
}

}  // namespace

std::vector<std::string> replicasOf(const std::string& server) {
  std::vector<std::string> replicas;
  std::istringstream words(server);
  for (std::string word; std::getline(words, word, ',');) replicas.push_back(word);
  if (server.ends_with(',')) replicas.emplace_back();
  return replicas;
}

Target targetOf(const std::string& server) {
  const auto replicas = replicasOf(server);
  const bool addresses = server.starts_with("ipv4:") || server.starts_with("ipv6:");
  if (addresses || server.starts_with("unix") || replicas.size() < 2)
    return {server, addresses || server.starts_with("dns:"), ""};
  // A target of gRPC holds addresses of one family.
  const auto authority = hostPortOf(replicas.front()).host;
  if (const auto list = addressList(replicas, AF_INET); !list.empty()) return {"ipv4:" + list, true, authority};
  if (const auto list = addressList(replicas, AF_INET6); !list.empty()) return {"ipv6:" + list, true, authority};
  throwNoAddresses(replicas);
}

bool staysHere(const std::string& server) {
  const auto replicas = replicasOf(server);
  return !replicas.empty() && std::all_of(replicas.begin(), replicas.end(), replicaStaysHere);
}

}  // namespace shaped::client
