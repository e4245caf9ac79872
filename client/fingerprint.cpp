#include "client/fingerprint.h"

#include <algorithm>
#include <cctype>

namespace shaped::client {

void Fingerprint::add(const void* data, std::size_t size) {
  for (const auto* byte = static_cast<const unsigned char*>(data); size > 0; --size, ++byte)
    value_ = (value_ ^ *byte) * 1099511628211ULL;
}

std::string Fingerprint::text() const {
  std::string digits;
  for (int shift = 60; shift >= 0; shift -= 4) digits.push_back("0123456789abcdef"[(value_ >> shift) & 15]);
  return digits;
}

std::string datasetName(const std::string& what, const std::string& prefix, const Fingerprint& content) {
  constexpr std::size_t longest_prefix = 70;  // names have at most 100 characters
  std::string name = prefix.substr(0, longest_prefix);
  // Whether the model's name will do is for the daemon to say, of the model.
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return what + "-" + name + "-" + content.text();
}

}  // namespace shaped::client
