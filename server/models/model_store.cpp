#include "server/models/model_store.h"

#include <algorithm>

#include "core/io/file_error.h"
#include "core/model/shell_pga_file.h"

namespace shaped::server {
namespace {

constexpr const char* kDataset = "dataset";
constexpr const char* kCreated = "created";  // seconds since 1970

nlohmann::json toJson(const Provenance& provenance) {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(provenance.created.time_since_epoch());
  return {{kDataset, provenance.dataset}, {kCreated, seconds.count()}};
}

}  // namespace

Provenance provenanceOf(const ModelManifest& manifest) {
  // Models from elsewhere have none.
  const auto found = manifest.description.find("provenance");
  if (found == manifest.description.end() || !found->is_object()) return {};
  return {found->value(kDataset, ""),
          std::chrono::system_clock::time_point(std::chrono::seconds(found->value(kCreated, std::int64_t{0})))};
}

ModelStore::ModelStore(const std::filesystem::path& root, std::size_t most_loaded)
    : directory_(root), most_loaded_(most_loaded) {}

std::uint64_t ModelStore::resolve(const std::string& name, std::uint64_t version) const {
  if (version != 0) return version;
  const auto versions = directory_.versions(name);
  if (versions.empty()) throw ModelNotFound("model", "there is no model \"" + name + "\"");
  return static_cast<std::uint64_t>(versions.back());
}

ServedModelPtr ModelStore::pin(const std::string& name, std::uint64_t version) {
  const Key key{name, resolve(name, version)};
  const auto slot = slotOf(key);
  const std::scoped_lock lock(slot->loading);
  if (slot->model) return slot->model;
  const auto stored = directory_.load(name, static_cast<std::int64_t>(key.second));
  auto model = std::make_shared<ServedModel>();
  *model = {name, key.second, stored.manifest, loadShellPga(stored)};
  return slot->model = std::move(model);
}

std::shared_ptr<ModelStore::Slot> ModelStore::slotOf(const Key& key) {
  const std::scoped_lock lock(mutex_);
  auto& slot = slots_[key];
  if (!slot) slot = std::make_shared<Slot>();
  const auto result = slot;
  used_.remove(key);
  used_.push_front(key);
  // A model that drops out here lives on while requests hold it.
  for (; used_.size() > most_loaded_; used_.pop_back()) slots_.erase(used_.back());
  return result;
}

std::vector<ModelStore::Entry> ModelStore::list() const {
  std::vector<Entry> entries;
  for (const auto& name : directory_.models())
    for (const auto version : directory_.versions(name)) try {
        entries.push_back({name, static_cast<std::uint64_t>(version), directory_.manifest(name, version)});
      } catch (const ModelNotFound&) {  // removed while we looked
      } catch (const FileError&) {      // damaged: asking for it by name says how
      }
  return entries;
}

ServedModelPtr ModelStore::publish(const std::string& name, ShellPgaModelPtr model, const Provenance& provenance) {
  const auto version = publishShellPga(directory_, name, *model, toJson(provenance));
  const Key key{name, static_cast<std::uint64_t>(version)};
  auto served = std::make_shared<ServedModel>();
  *served = {name, key.second, directory_.manifest(name, version), std::move(model)};
  const auto slot = slotOf(key);
  const std::scoped_lock lock(slot->loading);
  return slot->model = std::move(served);
}

std::vector<std::uint64_t> ModelStore::remove(const std::string& name, std::uint64_t version) {
  std::vector<std::uint64_t> removed;
  if (version != 0) {
    directory_.remove(name, static_cast<std::int64_t>(version));
    removed.push_back(version);
  } else {
    for (const auto each : directory_.versions(name)) removed.push_back(static_cast<std::uint64_t>(each));
    directory_.remove(name);
  }
  const std::scoped_lock lock(mutex_);
  for (const auto each : removed) {
    slots_.erase({name, each});
    used_.remove({name, each});
  }
  return removed;
}

}  // namespace shaped::server
