#pragma once

#include <grpcpp/support/status.h>

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "server/security/token_table.h"

namespace shaped::server {

/// What a call brings to say who makes it.
struct Credentials {
  std::string_view authorization;  ///< the metadata "authorization"; empty when there is none
  std::string_view common_name;  ///< of a client certificate that the handshake has verified; empty when there is none
};

/// Decides who may call what. Safe from any thread.
///
/// Without a tokens file, whoever can connect may do everything: on the loopback everybody, with client certificates
/// whoever has one. With a tokens file, a call needs one of its tokens, or a certificate that it names; a token that is
/// brought counts, and a faulty one is not made good by a certificate.
class Access {
 public:
  /// From now on these tokens and no others.
  void use(TokenTable table);

  /// OK, UNAUTHENTICATED (does not tell what is wrong with a token) or PERMISSION_DENIED (names method and role).
  /// method as the wire has it.
  /// What is not OK counts as a denial.
  grpc::Status judge(std::string_view method, const Credentials& credentials) const;
  /// Whether the caller may do what needs this role: for what the method alone does not decide.
  bool holds(const Credentials& credentials, Role role) const;
  /// How many calls were judged otherwise than OK, by status, since the start.
  std::map<grpc::StatusCode, std::uint64_t> denials() const;
  /// The caller's name, for the log; empty when it has none or is not known.
  std::string nameOf(const Credentials& credentials) const;

 private:
  grpc::Status verdict(std::string_view method, const Credentials& credentials) const;
  std::optional<Client> clientOf(const Credentials& credentials) const;

  mutable std::mutex mutex_;
  std::shared_ptr<const TokenTable> table_;  // none: no tokens file
  mutable std::atomic<std::uint64_t> unauthenticated_{0}, denied_{0};
};

}  // namespace shaped::server
