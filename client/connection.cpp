#include "client/connection.h"

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/channel_arguments.h>
#include <grpcpp/support/client_interceptor.h>

#include "client/retries.h"
#include "client/target.h"
#include "core/io/file.h"
#include "core/numerics/error.h"

#include <cstdlib>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"

namespace shaped::client {

namespace {

grpc::SslCredentialsOptions pemTexts(const ConnectionOptions& options) {
  if (options.certificate.empty() != options.key.empty())
    throw InvalidInput(options.key.empty() ? "--key" : "--cert", "is missing: certificate and key come together");
  const auto read = [](const auto& path) { return path.empty() ? std::string() : readFile(path); };
  return {.pem_root_certs = read(options.ca),
          .pem_private_key = read(options.key),
          .pem_cert_chain = read(options.certificate)};
}

std::shared_ptr<grpc::ChannelCredentials> tlsCredentials(const ConnectionOptions& options) {
  return grpc::SslCredentials(pemTexts(options));
}

/// Adds the token to a call. gRPC's own call credentials do so over TLS only; the loopback needs none.
class TokenBearer final : public grpc::experimental::Interceptor {
 public:
  explicit TokenBearer(const std::string& token) : authorization_("Bearer " + token) {}

  void Intercept(grpc::experimental::InterceptorBatchMethods* batch) override {
    if (batch->QueryInterceptionHookPoint(grpc::experimental::InterceptionHookPoints::PRE_SEND_INITIAL_METADATA))
      batch->GetSendInitialMetadata()->emplace("authorization", authorization_);
    batch->Proceed();
  }

 private:
  const std::string authorization_;
};

class TokenBearerFactory final : public grpc::experimental::ClientInterceptorFactoryInterface {
 public:
  explicit TokenBearerFactory(std::string token) : token_(std::move(token)) {}
  grpc::experimental::Interceptor* CreateClientInterceptor(grpc::experimental::ClientRpcInfo*) override {
    return new TokenBearer(token_);
  }

 private:
  const std::string token_;
};

std::vector<std::unique_ptr<grpc::experimental::ClientInterceptorFactoryInterface>> tokenBearers(
    const std::string& token) {
  std::vector<std::unique_ptr<grpc::experimental::ClientInterceptorFactoryInterface>> factories;
  factories.push_back(std::make_unique<TokenBearerFactory>(token));
  return factories;
}

}  // namespace

RpcError::RpcError(const grpc::Status& status)
    : std::runtime_error(status.error_message()), code_(status.error_code()) {
  google::rpc::Status details;
  if (!details.ParseFromString(status.error_details())) return;
  for (const auto& detail : details.details()) {
    google::rpc::ErrorInfo info;
    google::rpc::BadRequest request;
    google::rpc::RetryInfo retry;
    if (detail.UnpackTo(&info) && info.domain() == "shaped") reason_ = info.reason();
    if (detail.UnpackTo(&request) && request.field_violations_size() > 0) field_ = request.field_violations(0).field();
    if (detail.UnpackTo(&retry))
      retry_after_ =
          std::chrono::milliseconds(retry.retry_delay().seconds() * 1000 + retry.retry_delay().nanos() / 1'000'000);
  }
}

void require(const grpc::Status& status) {
  if (!status.ok()) throw RpcError(status);
}

std::shared_ptr<grpc::Channel> connect(const ConnectionOptions& options) {
  if (!options.token.empty() && !options.encrypted() && !staysHere(options.server))
    throw InvalidInput("token", "would travel to " + options.server +
                                    " in the clear, for everybody on the way to read; use TLS (--tls, --ca)");
  const auto target = targetOf(options.server);
  grpc::ChannelArguments arguments;
  // The daemon has the limits (Server.GetLimits) and says so when a message is too large.
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetMaxSendMessageSize(-1);
  if (!target.authority.empty()) arguments.SetString(GRPC_ARG_DEFAULT_AUTHORITY, target.authority);
  retryIdempotentCalls(arguments, target.balanced);
  if (!options.retries) arguments.SetInt(GRPC_ARG_ENABLE_RETRIES, 0);
  // Channels whose arguments are alike share a connection; gRPC has no say in what this one means.
  arguments.SetInt("shaped.connection", options.number);
  const auto credentials = options.encrypted() ? tlsCredentials(options) : grpc::InsecureChannelCredentials();
  if (options.token.empty()) return grpc::CreateCustomChannel(target.uri, credentials, arguments);
  return grpc::experimental::CreateCustomChannelWithInterceptors(target.uri, credentials, arguments,
                                                                 tokenBearers(options.token));
}

const TraceContext& processTrace() {
  static const TraceContext trace = [] {
    const char* header = std::getenv("TRACEPARENT");
    const auto given = parseTraceparent(header ? header : "");
    return given ? *given : newTrace();
  }();
  return trace;
}

Call::Call(const CallOptions& options) : on_stop_(options.stop, [this] { context_.TryCancel(); }) {
  context_.AddMetadata(kTraceparent, (options.trace ? *options.trace : processTrace()).child().header());
  if (!options.priority.empty()) context_.AddMetadata("shaped-priority", options.priority);
  if (options.timeout)
    context_.set_deadline(std::chrono::system_clock::now() +
                          std::chrono::duration_cast<std::chrono::system_clock::duration>(*options.timeout));
}

}  // namespace shaped::client
