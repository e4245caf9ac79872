#include "client/diagnosis.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <array>
#include <memory>

namespace shaped::client {
namespace {

constexpr timeval kPatience{2, 0};

struct Address {
  std::string host, port;
};

/// HOST:PORT or [HOST]:PORT; no host for other targets.
Address addressOf(const std::string& server) {
  const auto colon = server.rfind(':');
  if (colon == std::string::npos || server.starts_with("unix")) return {};
  auto host = server.substr(0, colon);
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  return {host, server.substr(colon + 1)};
}

class Socket {
 public:
  explicit Socket(const Address& address) {
    addrinfo* found = nullptr;
    addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    if (getaddrinfo(address.host.c_str(), address.port.c_str(), &hints, &found) != 0) return;
    const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> all(found, &freeaddrinfo);
    for (const auto* each = all.get(); each && descriptor_ < 0; each = each->ai_next) tryTo(*each);
  }
  ~Socket() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  int descriptor() const { return descriptor_; }

 private:
  void tryTo(const addrinfo& address) {
    descriptor_ = socket(address.ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (descriptor_ < 0) return;
    setsockopt(descriptor_, SOL_SOCKET, SO_RCVTIMEO, &kPatience, sizeof kPatience);
    setsockopt(descriptor_, SOL_SOCKET, SO_SNDTIMEO, &kPatience, sizeof kPatience);  // of connect() too
    if (::connect(descriptor_, address.ai_addr, address.ai_addrlen) == 0) return;
    close(descriptor_);
    descriptor_ = -1;
  }

  int descriptor_ = -1;
};

using Context = std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)>;
using Session = std::unique_ptr<SSL, decltype(&SSL_free)>;

Context contextFor(const ConnectionOptions& options) {
  Context context(SSL_CTX_new(TLS_client_method()), &SSL_CTX_free);
  if (options.ca.empty())
    SSL_CTX_set_default_verify_paths(context.get());
  else
    SSL_CTX_load_verify_locations(context.get(), options.ca.c_str(), nullptr);
  if (!options.certificate.empty()) {
    SSL_CTX_use_certificate_chain_file(context.get(), options.certificate.c_str());
    SSL_CTX_use_PrivateKey_file(context.get(), options.key.c_str(), SSL_FILETYPE_PEM);
  }
  constexpr std::array<unsigned char, 3> http2{2, 'h', '2'};
  SSL_CTX_set_alpn_protos(context.get(), http2.data(), http2.size());
  return context;
}

/// Whom the certificate must name.
void expectHost(SSL& session, const std::string& host) {
  std::array<unsigned char, sizeof(in6_addr)> number{};
  const bool is_number =
      inet_pton(AF_INET, host.c_str(), number.data()) == 1 || inet_pton(AF_INET6, host.c_str(), number.data()) == 1;
  if (is_number) {
    X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(&session), host.c_str());
    return;
  }
  SSL_set_tlsext_host_name(&session, host.c_str());
  SSL_set1_host(&session, host.c_str());
}

std::string verdictOn(long verification, const std::string& host) {
  switch (verification) {
    case X509_V_OK:
      return "";
    case X509_V_ERR_CERT_HAS_EXPIRED:
      return "the daemon's certificate has expired; its operator must renew it";
    case X509_V_ERR_CERT_NOT_YET_VALID:
      return "the daemon's certificate is not valid yet; compare the clocks of both machines";
    case X509_V_ERR_HOSTNAME_MISMATCH:
    case X509_V_ERR_IP_ADDRESS_MISMATCH:
      return "the daemon's certificate is for other names than \"" + host +
             "\"; name the host as the certificate does, or let its operator add this name";
    default:
      return std::string("the daemon's certificate is not trusted (") + X509_verify_cert_error_string(verification) +
             "); name the authority that signed it with --ca FILE";
  }
}

/// Whether the daemon takes the client's certificate shows only after the handshake: it greets, or closes without a
/// word.
std::string verdictOnClient(SSL& session, bool has_certificate) {
  char byte = 0;
  ERR_clear_error();
  const int read = SSL_read(&session, &byte, 1);
  const int outcome = SSL_get_error(&session, read);
  if (read > 0 || (outcome != SSL_ERROR_SSL && outcome != SSL_ERROR_ZERO_RETURN)) return "";
  return has_certificate
             ? "the daemon refuses your certificate (--cert): it has expired, or is not of an authority that "
               "the daemon trusts; get one from its operator"
             : "the daemon serves only clients with a certificate; show yours with --cert FILE --key FILE";
}

}  // namespace

std::string diagnose(const ConnectionOptions& options) {
  const auto address = addressOf(options.server);
  const Socket socket(address);
  if (address.host.empty() || socket.descriptor() < 0) return "";
  const auto context = contextFor(options);
  const Session session(SSL_new(context.get()), &SSL_free);
  expectHost(*session, address.host);
  SSL_set_fd(session.get(), socket.descriptor());
  ERR_clear_error();
  const bool speaks_tls = SSL_connect(session.get()) == 1;
  const bool answers_in_clear = ERR_GET_REASON(ERR_peek_last_error()) == SSL_R_WRONG_VERSION_NUMBER;
  if (!options.encrypted())
    return speaks_tls ? "the daemon wants TLS; add --tls, and --ca FILE for a private authority" : "";
  if (!speaks_tls)
    return answers_in_clear ? "the daemon does not speak TLS; leave out --tls, --ca and --cert"
                            : verdictOnClient(*session, !options.certificate.empty());
  const auto verdict = verdictOn(SSL_get_verify_result(session.get()), address.host);
  return verdict.empty() ? verdictOnClient(*session, !options.certificate.empty()) : verdict;
}

}  // namespace shaped::client
