#pragma once

#include <grpcpp/security/server_credentials.h>

#include <atomic>
#include <deque>
#include <memory>
#include <mutex>

#include "server/security/access.h"
#include "server/security/certificates.h"

namespace shaped::server {

/// How connections come in: in the clear or over TLS 1.2 or later, with the certificates in use at the moment of each
/// handshake; and who is let through to a service. Must outlive the server that it was given to.
///
/// Written on gRPC's C interface. What its C++ interface offers for certificates that change,
/// FileWatcherCertificateProvider, refuses every connection while the files do not belong together (tried with gRPC
/// 1.51: key replaced, certificate not yet); the fetcher below keeps the last good ones. And only here can calls in the
/// clear be judged before their messages are read.
class Transport final : public grpc::ServerCredentials {
 public:
  /// access null: nobody is asked who he is. certificates null: in the clear.
  Transport(std::shared_ptr<const Access> access, std::shared_ptr<const Certificates> certificates);

  /// New handshakes take these; connections stay as they are. Only where there were certificates from the start, and
  /// with a client CA only if there was one.
  void use(std::shared_ptr<const Certificates> certificates);
  std::shared_ptr<const Certificates> certificates() const;

 private:
  /// Which certificates a listening port has got.
  struct Port {
    const Transport& transport;
    std::shared_ptr<const Certificates> in_use;
  };

  static grpc_ssl_certificate_config_reload_status fetch(void* port, grpc_ssl_server_certificate_config** config);
  grpc_server_credentials* makeCredentials();
  void SetAuthMetadataProcessor(const std::shared_ptr<grpc::AuthMetadataProcessor>&) override {}
  int AddPortToServer(const std::string& address, grpc_server* server) override;

  const std::shared_ptr<const Access> access_;
  mutable std::mutex mutex_;
  std::shared_ptr<const Certificates> certificates_;
  std::deque<Port> ports_;
};

}  // namespace shaped::server
