#include "server/security/loopback.h"

#include <arpa/inet.h>
#include <netdb.h>

#include <memory>
#include <optional>

namespace shaped::server {
namespace {

/// HOST of HOST:PORT or [HOST]:PORT; nothing when there is no port.
std::optional<std::string> hostOf(const std::string& address) {
  const auto colon = address.rfind(':');
  if (colon == std::string::npos || colon == 0) return std::nullopt;
  const auto host = address.substr(0, colon);
  if (host.front() == '[') return host.back() == ']' ? std::optional(host.substr(1, host.size() - 2)) : std::nullopt;
  // More colons: an IPv6 address whose port nobody can tell.
  return host.find(':') == std::string::npos ? std::optional(host) : std::nullopt;
}

bool isLoopback(const sockaddr& address) {
  constexpr std::uint32_t net = 127U << 24, mask = 255U << 24;
  if (address.sa_family == AF_INET)
    return (ntohl(reinterpret_cast<const sockaddr_in&>(address).sin_addr.s_addr) & mask) == net;
  if (address.sa_family != AF_INET6) return false;
  const auto& six = reinterpret_cast<const sockaddr_in6&>(address).sin6_addr;
  return IN6_IS_ADDR_LOOPBACK(&six) || (IN6_IS_ADDR_V4MAPPED(&six) && six.s6_addr[12] == 127);
}

}  // namespace

bool isLoopback(const std::string& address) {
  if (address.starts_with("unix:") || address.starts_with("unix-abstract:")) return true;
  const auto host = hostOf(address);
  if (!host || host->empty()) return false;
  addrinfo* found = nullptr;
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  if (getaddrinfo(host->c_str(), nullptr, &hints, &found) != 0) return false;
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> all(found, &freeaddrinfo);
  for (const auto* each = all.get(); each; each = each->ai_next)
    if (!isLoopback(*each->ai_addr)) return false;
  return true;
}

}  // namespace shaped::server
