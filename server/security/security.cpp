#include "server/security/security.h"

#include <sys/stat.h>

#include "core/io/file.h"
#include "core/io/file_error.h"
#include "core/numerics/error.h"
#include "server/security/loopback.h"
#include "server/telemetry/call_log.h"

namespace shaped::server {
namespace {

constexpr std::chrono::seconds kWatchPeriod(2);
constexpr std::chrono::days kExpiresSoon(14);

void requireTogether(const SecurityOptions& options) {
  const auto& [chain, key, client_ca] = options.certificates;
  if (chain.empty() != key.empty())
    throw InvalidInput(chain.empty() ? "--tls-cert" : "--tls-key", "is missing: certificate and key come together");
  if (chain.empty() && !client_ca.empty())
    throw InvalidInput("--tls-client-ca", "needs --tls-cert and --tls-key: client certificates are a part of TLS");
}

void requireReachable(const SecurityOptions& options, const std::string& listen) {
  if (!options.certificates.chain.empty() || options.anywhere || isLoopback(listen)) return;
  throw InvalidInput("--listen", listen +
                                     " can be reached from other machines, and calls would travel in the clear. Give "
                                     "--tls-cert and --tls-key (and --tokens or --tls-client-ca to say who may call), "
                                     "listen on 127.0.0.1, or say --listen-insecurely " +
                                     listen + " where the network itself is secured");
}

void say(const Certificates& certificates, const CertificateFiles& files) {
  const auto left = certificates.expires - std::chrono::system_clock::now();
  const auto days = std::to_string(std::chrono::floor<std::chrono::days>(left).count());
  const auto line =
      "certificate \"" + certificates.subject + "\" of " + files.chain.string() + " is good for " + days + " days";
  left < kExpiresSoon ? logWarning(line + "; renew it") : logInfo(line);
  if (certificates.key_readable_by_all)
    logWarning(files.key.string() + " can be read by every user of this machine; chmod 600 it");
}

void requireGuarded(const std::filesystem::path& tokens) {
  struct stat status {};
  if (stat(tokens.c_str(), &status) == 0 && (status.st_mode & S_IWOTH) != 0)
    throw InvalidInput("", tokens.string() + " can be written by every user of this machine; chmod 600 it");
}

/// Runs a part of a reload; what fails leaves things as they are.
void keeping(const std::string& what, const std::function<void()>& load) try {
  load();
} catch (const std::exception& error) {
  logError("the " + what + " in force stay: " + error.what());
}

}  // namespace

Security::Security(SecurityOptions options, const std::string& listen) : options_(std::move(options)) {
  requireTogether(options_);
  requireReachable(options_, listen);
  std::vector<std::filesystem::path> files;
  for (const auto& file :
       {options_.certificates.chain, options_.certificates.key, options_.certificates.client_ca, options_.tokens})
    if (!file.empty()) files.push_back(file);
  // Watched before they are read, so that no change falls between; a change waits for the lock.
  const std::scoped_lock lock(mutex_);
  if (!files.empty()) watch_.emplace(std::move(files), kWatchPeriod, [this] { reload(); });
  if (!options_.tokens.empty() || !options_.certificates.client_ca.empty()) access_ = std::make_shared<Access>();
  if (!options_.tokens.empty()) access_->use(loadTokens());
  transport_ = std::make_shared<Transport>(access_, encrypted() ? loadCertificates() : nullptr);
  warnOfWhatIsOpen(listen);
}

void Security::reload() {
  const std::scoped_lock lock(mutex_);
  if (encrypted()) keeping("certificates", [this] { transport_->use(loadCertificates()); });
  if (!options_.tokens.empty()) keeping("tokens", [this] { access_->use(loadTokens()); });
}

std::shared_ptr<const Certificates> Security::loadCertificates() const {
  auto certificates = std::make_shared<const Certificates>(readCertificates(options_.certificates));
  say(*certificates, options_.certificates);
  return certificates;
}

TokenTable Security::loadTokens() const try {
  requireGuarded(options_.tokens);
  TokenTable table(readFile(options_.tokens));
  logInfo(options_.tokens.string() + " names " + std::to_string(table.size()) + " clients");
  return table;
} catch (const FileError& error) {
  throw InvalidInput("--tokens", error.what());
} catch (const InvalidInput& error) {
  const std::string text(error.what()), file = options_.tokens.string();
  throw InvalidInput("--tokens", text.find(file) == std::string::npos ? file + ": " + text : text);
}

void Security::warnOfWhatIsOpen(const std::string& listen) const {
  if (isLoopback(listen)) return;
  if (!access_)
    logWarning("whoever reaches " + listen + " may do everything: neither --tokens nor --tls-client-ca is given");
  if (!encrypted()) logWarning("calls to " + listen + " travel in the clear, tokens too");
}

}  // namespace shaped::server
