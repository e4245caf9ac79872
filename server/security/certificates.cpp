#include "server/security/certificates.h"

#include <openssl/pem.h>
#include <openssl/x509.h>
#include <sys/stat.h>

#include <ctime>
#include <memory>
#include <vector>

#include "core/io/file.h"
#include "core/io/file_error.h"
#include "core/numerics/error.h"

namespace shaped::server {
namespace {

using Bio = std::unique_ptr<BIO, decltype(&BIO_free)>;
using X509Ptr = std::unique_ptr<X509, decltype(&X509_free)>;
using KeyPtr = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;

/// A file that an option names, in the words of the option.
struct OptionFile {
  std::string option;
  std::filesystem::path path;

  [[noreturn]] void fail(const std::string& problem) const {
    throw InvalidInput(option, path.string() + " " + problem);
  }
  std::string read() const try { return readFile(path); } catch (const InvalidInput& error) {
    throw InvalidInput(option, error.what());
  } catch (const FileError& error) {
    throw InvalidInput(option, error.what());
  }
};

Bio memory(const std::string& text) { return {BIO_new_mem_buf(text.data(), static_cast<int>(text.size())), &BIO_free}; }

std::vector<X509Ptr> certificatesIn(const OptionFile& file, const std::string& text) {
  const auto bio = memory(text);
  std::vector<X509Ptr> certificates;
  while (auto* certificate = PEM_read_bio_X509(bio.get(), nullptr, nullptr, nullptr))
    certificates.emplace_back(certificate, &X509_free);
  if (certificates.empty()) file.fail("holds no certificate in PEM form (-----BEGIN CERTIFICATE-----)");
  return certificates;
}

/// The daemon has no terminal to ask on.
int noPassword(char*, int, int, void* asked) {
  *static_cast<bool*>(asked) = true;
  return -1;
}

KeyPtr keyIn(const OptionFile& file, const std::string& text) {
  bool encrypted = false;
  const auto bio = memory(text);
  KeyPtr key(PEM_read_bio_PrivateKey(bio.get(), nullptr, &noPassword, &encrypted), &EVP_PKEY_free);
  if (encrypted) file.fail("is encrypted; decrypt it (openssl pkey -in KEY -out PLAIN) and guard it by its mode, 0600");
  if (!key) file.fail("holds no private key in PEM form (-----BEGIN PRIVATE KEY-----)");
  return key;
}

std::chrono::system_clock::time_point timeOf(const ASN1_TIME* time) {
  std::tm parts{};
  ASN1_TIME_to_tm(time, &parts);
  return std::chrono::system_clock::from_time_t(timegm(&parts));
}

std::string textOf(std::chrono::system_clock::time_point time) {
  const auto seconds = std::chrono::system_clock::to_time_t(time);
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

void requireValidNow(const OptionFile& file, const X509& certificate) {
  const auto now = std::chrono::system_clock::now();
  const auto begins = timeOf(X509_get0_notBefore(&certificate)), ends = timeOf(X509_get0_notAfter(&certificate));
  if (ends <= now) file.fail("has expired on " + textOf(ends) + "; put a new certificate there");
  if (begins > now) file.fail("is not valid before " + textOf(begins) + "; check it, and this machine's clock");
}

std::string commonName(const X509& certificate) {
  char text[256] = "";
  X509_NAME_get_text_by_NID(X509_get_subject_name(&certificate), NID_commonName, text, sizeof text);
  return text;
}

bool readableByAll(const std::filesystem::path& path) {
  struct stat status {};
  return stat(path.c_str(), &status) == 0 && (status.st_mode & S_IROTH) != 0;
}

}  // namespace

Certificates readCertificates(const CertificateFiles& files) {
  const OptionFile chain{"--tls-cert", files.chain}, key{"--tls-key", files.key},
      client_ca{"--tls-client-ca", files.client_ca};
  Certificates read{.chain = chain.read(), .key = key.read(), .client_ca = {}, .subject = {}, .expires = {}};
  const auto certificates = certificatesIn(chain, read.chain);
  const auto& own = *certificates.front();
  if (X509_check_private_key(&own, keyIn(key, read.key).get()) != 1)
    key.fail("is not the key of the first certificate in " + files.chain.string());
  requireValidNow(chain, own);
  read.subject = commonName(own);
  read.expires = timeOf(X509_get0_notAfter(&own));
  read.key_readable_by_all = readableByAll(files.key);
  if (files.client_ca.empty()) return read;
  read.client_ca = client_ca.read();
  certificatesIn(client_ca, read.client_ca);
  return read;
}

}  // namespace shaped::server
