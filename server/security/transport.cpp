#include "server/security/transport.h"

#include <grpc/grpc_security.h>

#include "server/telemetry/call_log.h"

namespace shaped::server {
namespace {

std::string_view textOf(const grpc_slice& slice) {
  return {reinterpret_cast<const char*>(GRPC_SLICE_START_PTR(slice)), GRPC_SLICE_LENGTH(slice)};
}

std::string_view commonNameOf(const grpc_auth_context* context) {
  auto found = grpc_auth_context_find_properties_by_name(context, GRPC_X509_CN_PROPERTY_NAME);
  const auto* property = grpc_auth_property_iterator_next(&found);
  return property ? std::string_view(property->value, property->value_length) : std::string_view();
}

/// gRPC asks here after a call's metadata and before its first message, for every service.
void judge(void* state, grpc_auth_context* context, const grpc_metadata* metadata, std::size_t count,
           grpc_process_auth_metadata_done_cb done, void* user_data) {
  const auto& access = **static_cast<std::shared_ptr<const Access>*>(state);
  std::string_view method;
  Credentials credentials{{}, commonNameOf(context)};
  for (std::size_t i = 0; i < count; ++i) {
    if (textOf(metadata[i].key) == ":path") method = textOf(metadata[i].value);
    if (textOf(metadata[i].key) == "authorization") credentials.authorization = textOf(metadata[i].value);
  }
  const auto status = access.judge(method, credentials);
  if (!status.ok()) logRefusal(std::string(method), access.nameOf(credentials), status.error_message());
  done(user_data, nullptr, 0, nullptr, 0, static_cast<grpc_status_code>(status.error_code()),
       status.error_message().c_str());
}

void forget(void* state) { delete static_cast<std::shared_ptr<const Access>*>(state); }

grpc_ssl_server_certificate_config* configOf(const Certificates& certificates) {
  const grpc_ssl_pem_key_cert_pair pair{certificates.key.c_str(), certificates.chain.c_str()};
  // gRPC 1.51 aborts without roots, also where it asks clients for no certificate and never looks at them.
  const auto& roots = certificates.client_ca.empty() ? certificates.chain : certificates.client_ca;
  return grpc_ssl_server_certificate_config_create(roots.c_str(), &pair, 1);
}

}  // namespace

Transport::Transport(std::shared_ptr<const Access> access, std::shared_ptr<const Certificates> certificates)
    : access_(std::move(access)), certificates_(std::move(certificates)) {}

void Transport::use(std::shared_ptr<const Certificates> certificates) {
  const std::scoped_lock lock(mutex_);
  certificates_ = std::move(certificates);
}

std::shared_ptr<const Certificates> Transport::certificates() const {
  const std::scoped_lock lock(mutex_);
  return certificates_;
}

/// gRPC calls this at every handshake of a port, one at a time.
grpc_ssl_certificate_config_reload_status Transport::fetch(void* user_data,
                                                           grpc_ssl_server_certificate_config** config) {
  auto& port = *static_cast<Port*>(user_data);
  const auto latest = port.transport.certificates();
  if (latest == port.in_use) return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_UNCHANGED;
  *config = configOf(*latest);
  port.in_use = latest;
  return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_NEW;
}

grpc_server_credentials* Transport::makeCredentials() {
  const auto certificates = this->certificates();
  if (!certificates) return grpc_insecure_server_credentials_create();
  ports_.push_back({*this, nullptr});
  const auto demand = certificates->client_ca.empty() ? GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE
                                                      : GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY;
  return grpc_ssl_server_credentials_create_with_options(
      grpc_ssl_server_credentials_create_options_using_config_fetcher(demand, &Transport::fetch, &ports_.back()));
}

int Transport::AddPortToServer(const std::string& address, grpc_server* server) {
  auto* credentials = makeCredentials();
  if (access_)
    grpc_server_credentials_set_auth_metadata_processor(credentials,
                                                        {&judge, &forget, new std::shared_ptr<const Access>(access_)});
  const int port = grpc_server_add_http2_port(server, address.c_str(), credentials);
  grpc_server_credentials_release(credentials);
  return port;
}

}  // namespace shaped::server
