#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "server/security/file_watch.h"
#include "server/security/transport.h"

namespace shaped::server {

struct SecurityOptions {
  CertificateFiles certificates;  ///< chain empty: no TLS
  std::filesystem::path tokens;   ///< a tokens file; empty: no tokens
  bool anywhere = false;          ///< whether to serve in the clear beyond the loopback too
};

/// Who may connect and call: TLS, client certificates and tokens as the options say, taken anew while running when a
/// file changes. What is wrong with a new file is logged, and what was in force stays.
class Security {
 public:
  /// Throws InvalidInput that names option and file when a file is faulty, options do not go together, or the daemon
  /// would listen in the clear on an address that others can reach.
  Security(SecurityOptions options, const std::string& listen);

  /// What the server listens with; must not outlive this object.
  std::shared_ptr<grpc::ServerCredentials> transport() const { return transport_; }
  /// Null when nobody is asked who he is.
  const Access* access() const { return access_.get(); }
  /// Reads all files anew, as the watch does when one changes. From any thread; never throws.
  void reload();

 private:
  bool encrypted() const { return !options_.certificates.chain.empty(); }
  std::shared_ptr<const Certificates> loadCertificates() const;
  TokenTable loadTokens() const;
  void warnOfWhatIsOpen(const std::string& listen) const;

  const SecurityOptions options_;
  std::mutex mutex_;
  std::shared_ptr<Access> access_;
  std::shared_ptr<Transport> transport_;
  std::optional<FileWatch> watch_;
};

}  // namespace shaped::server
