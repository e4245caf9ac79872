#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace shaped::client {

/// FNV-1a over 64 bits: tells contents apart, no more.
class Fingerprint {
 public:
  void add(const void* data, std::size_t size);
  template <class Number>
  void addAll(const Number* numbers, std::size_t count) {
    add(numbers, sizeof(Number) * count);
  }
  /// 16 hexadecimal digits.
  std::string text() const;

 private:
  std::uint64_t value_ = 14695981039346656037ULL;
};

/// A dataset name that follows from its content: "<what>-<prefix>-<16 hexadecimal digits>", the prefix cut and made of
/// letters, digits and '_'.
std::string datasetName(const std::string& what, const std::string& prefix, const Fingerprint& content);

}  // namespace shaped::client
