#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/models/served_model.h"

namespace shaped::server {

/// A version of a model.
using ModelKey = std::pair<std::string, std::uint64_t>;

/// Which version a name or a label means. Not for several threads at a time.
class VersionTable {
 public:
  /// The newest version known of a name; 0: none.
  std::uint64_t newest(const std::string& name) const;
  /// A version that is now known; counts when it is newer than the one before.
  void add(const ModelKey& key);
  /// The versions that are left of a name, rising; those known that are not among them are forgotten, with the labels
  /// of a name that has none. Labels of a version that is gone stay, and mean nothing that can be found.
  void keepOnly(const std::string& name, const std::vector<std::uint64_t>& left);
  /// version: 0: the label stands for nothing.
  void setLabel(const std::string& name, const std::string& label, std::uint64_t version);

  /// What a name alone stands for: "stable" where that is set, else the newest; 0: nothing.
  std::uint64_t serving(const std::string& name) const;
  std::vector<std::string> labelsOf(const ModelKey& key) const;
  /// The version that is meant, whether or not it is there; none when the name alone stands for nothing. Throws
  /// InvalidInput for a version beside a label, ModelNotFound for a label that stands for none.
  std::optional<ModelKey> resolve(const ModelSelector& selector) const;

 private:
  std::map<std::string, std::uint64_t> newest_;
  std::map<std::string, std::map<std::string, std::uint64_t>> labels_;
};

}  // namespace shaped::server
