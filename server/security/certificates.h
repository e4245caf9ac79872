#pragma once

#include <chrono>
#include <filesystem>
#include <string>

namespace shaped::server {

/// Where the daemon's certificates are. client_ca empty: clients need none.
struct CertificateFiles {
  std::filesystem::path chain, key, client_ca;
};

/// The content of those files, checked. PEM texts.
struct Certificates {
  std::string chain, key, client_ca;
  std::string subject;                            ///< common name, for the log
  std::chrono::system_clock::time_point expires;  ///< of the daemon's own certificate
  bool key_readable_by_all = false;
};

/// Reads and checks them. Throws InvalidInput that names option and file: missing or unreadable, no PEM, a key that is
/// encrypted or not the certificate's, a certificate that has expired or is not yet valid.
Certificates readCertificates(const CertificateFiles& files);

}  // namespace shaped::server
