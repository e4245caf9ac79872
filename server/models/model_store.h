#pragma once

#include <chrono>
#include <filesystem>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/io/model_directory.h"
#include "core/model/shell_pga_model.h"

namespace shaped::server {

/// A model in memory: one version, immutable. Whoever holds the pointer keeps it, whatever happens to the store.
struct ServedModel {
  std::string name;
  std::uint64_t version = 0;
  ModelManifest manifest;
  ShellPgaModelPtr shell_pga;
};
using ServedModelPtr = std::shared_ptr<const ServedModel>;

/// Where a model came from; kept in its manifest.
struct Provenance {
  std::string dataset;
  std::chrono::system_clock::time_point created;
};
Provenance provenanceOf(const ModelManifest& manifest);

/// The models under <root>/<name>/<version>/. Loads a version when it is first asked for, and keeps the ones used last
/// in memory. Safe from any thread.
class ModelStore {
 public:
  /// most_loaded: models that are kept in memory although no request uses them, >= 1.
  explicit ModelStore(const std::filesystem::path& root, std::size_t most_loaded = 16);

  /// The newest version of a name (0), or a given one. Loads it at need; others that want the same wait for that load.
  /// Throws ModelNotFound, InvalidInput for a bad name, FileError when its files are damaged.
  ServedModelPtr pin(const std::string& name, std::uint64_t version);

  /// A version without its tensors.
  struct Entry {
    std::string name;
    std::uint64_t version;
    ModelManifest manifest;
  };
  /// All versions by name and number, without loading any. A version whose manifest is damaged is left out.
  std::vector<Entry> list() const;

  /// Writes a new version; the model is then in memory. Throws FileError when the disk fails: nothing is left behind.
  ServedModelPtr publish(const std::string& name, ShellPgaModelPtr model, const Provenance& provenance);

  /// Removes one version, or all (0); returns the versions removed. Throws ModelNotFound; FileError when the disk
  /// fails.
  std::vector<std::uint64_t> remove(const std::string& name, std::uint64_t version);

 private:
  using Key = std::pair<std::string, std::uint64_t>;
  /// Loads at most once, whoever comes first; a failed load is tried again by the next.
  struct Slot {
    std::mutex loading;
    ServedModelPtr model;
  };

  std::uint64_t resolve(const std::string& name, std::uint64_t version) const;
  std::shared_ptr<Slot> slotOf(const Key& key);

  const ModelDirectory directory_;
  const std::size_t most_loaded_;
  std::mutex mutex_;
  std::map<Key, std::shared_ptr<Slot>> slots_;
  std::list<Key> used_;  // the latest first; the keys of slots_
};

}  // namespace shaped::server
