#include "server/models/version_table.h"

#include <algorithm>

namespace shaped::server {
namespace {

constexpr const char* kStable = "stable";

}  // namespace

std::uint64_t VersionTable::newest(const std::string& name) const {
  const auto found = newest_.find(name);
  return found == newest_.end() ? 0 : found->second;
}

void VersionTable::add(const ModelKey& key) {
  auto& newest = newest_[key.first];
  newest = std::max(newest, key.second);
}

void VersionTable::keepOnly(const std::string& name, const std::vector<std::uint64_t>& left) {
  if (left.empty()) {
    newest_.erase(name);
    labels_.erase(name);
    return;
  }
  const auto known = newest_.find(name);
  if (known == newest_.end() || std::binary_search(left.begin(), left.end(), known->second)) return;
  const auto above = std::upper_bound(left.begin(), left.end(), known->second);
  if (above == left.begin())
    newest_.erase(known);  // all that is left came later, and is not known yet
  else
    known->second = *std::prev(above);
}

void VersionTable::setLabel(const std::string& name, const std::string& label, std::uint64_t version) {
  if (version == 0)
    labels_[name].erase(label);
  else
    labels_[name][label] = version;
}

std::uint64_t VersionTable::serving(const std::string& name) const {
  if (const auto labels = labels_.find(name); labels != labels_.end())
    if (const auto stable = labels->second.find(kStable); stable != labels->second.end()) return stable->second;
  return newest(name);
}

std::vector<std::string> VersionTable::labelsOf(const ModelKey& key) const {
  std::vector<std::string> names;
  if (const auto labels = labels_.find(key.first); labels != labels_.end())
    for (const auto& [label, version] : labels->second)
      if (version == key.second) names.push_back(label);
  return names;
}

std::optional<ModelKey> VersionTable::resolve(const ModelSelector& selector) const {
  const auto& [name, version, label] = selector;
  if (version != 0 && !label.empty()) throw InvalidInput("model.label", "stands beside a version; name one of them");
  if (version != 0) return ModelKey{name, version};
  if (label.empty()) {
    const auto meant = serving(name);
    return meant == 0 ? std::nullopt : std::optional<ModelKey>({name, meant});
  }
  const auto labels = labels_.find(name);
  if (labels == labels_.end() || !labels->second.contains(label))
    throw ModelNotFound("model.label", "no version of \"" + name + "\" is labelled \"" + label + "\"");
  return ModelKey{name, labels->second.at(label)};
}

}  // namespace shaped::server
