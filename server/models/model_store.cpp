#include "server/models/model_store.h"

#include <algorithm>

#include "core/io/file_error.h"
#include "core/model/shell_pga_file.h"
#include "core/model/shell_pga_tasks.h"
#include "server/errors/errors.h"
#include "server/models/eviction.h"

namespace shaped::server {
namespace {

constexpr const char* kStable = "stable";
constexpr std::chrono::seconds kRetryDelay(1);

using Lock = std::scoped_lock<std::mutex>;

std::int64_t signedVersion(std::uint64_t version) { return static_cast<std::int64_t>(version); }

std::string megabytes(std::size_t bytes) { return std::to_string((bytes + (1 << 20) - 1) >> 20) + " MiB"; }

/// version: 0 for one that has no number yet.
OverBudget overBudget(const std::string& name, std::uint64_t version, std::size_t bytes, std::size_t budget) {
  return {"model \"" + name + "\"" + (version == 0 ? "" : " version " + std::to_string(version)) + " needs " +
              megabytes(bytes) + " of memory, which the budget of " + megabytes(budget) +
              " for models does not have; unload others or raise --model-megabytes",
          bytes <= budget};
}

}  // namespace

ModelStore::ModelStore(const std::filesystem::path& root, const ModelStoreOptions& options)
    : directory_(root), options_(options), loaders_(options.loaders, noLimits(), {}) {
  for (const auto& name : directory_.models()) {
    newest_[name] = static_cast<std::uint64_t>(directory_.versions(name).back());
    for (const auto& [label, version] : directory_.labels(name))
      labels_[name][label] = static_cast<std::uint64_t>(version);
  }
}

/// 0: none. Call with the mutex held.
std::uint64_t ModelStore::servingVersion(const std::string& name) const {
  if (const auto labels = labels_.find(name); labels != labels_.end())
    if (const auto stable = labels->second.find(kStable); stable != labels->second.end()) return stable->second;
  const auto newest = newest_.find(name);
  return newest == newest_.end() ? 0 : newest->second;
}

/// Call with the mutex held.
ModelStore::Key ModelStore::resolve(const ModelSelector& selector) const {
  const auto& [name, version, label] = selector;
  if (version != 0 && !label.empty()) throw InvalidInput("model.label", "stands beside a version; name one of them");
  if (version != 0) return {name, version};
  if (label.empty()) {
    directory_.versions(name);  // throws for a bad name
    if (const auto serving = servingVersion(name)) return {name, serving};
    throw ModelNotFound("model", "there is no model \"" + name + "\"");
  }
  const auto labels = labels_.find(name);
  if (labels == labels_.end() || !labels->second.contains(label))
    throw ModelNotFound("model.label", "no version of \"" + name + "\" is labelled \"" + label + "\"");
  return {name, labels->second.at(label)};
}

/// Call with the mutex held.
std::vector<std::string> ModelStore::labelsOf(const Key& key) const {
  std::vector<std::string> names;
  if (const auto labels = labels_.find(key.first); labels != labels_.end())
    for (const auto& [label, version] : labels->second)
      if (version == key.second) names.push_back(label);
  return names;
}

/// The key, version 0 replaced by the newest on the disk. Throws ModelNotFound.
ModelStore::Key ModelStore::requireStored(Key key) const {
  const auto versions = directory_.versions(key.first);
  if (versions.empty()) throw ModelNotFound("model", "there is no model \"" + key.first + "\"");
  if (key.second == 0) key.second = static_cast<std::uint64_t>(versions.back());
  if (!std::binary_search(versions.begin(), versions.end(), signedVersion(key.second)))
    throw ModelNotFound("model", "\"" + key.first + "\" has no version " + std::to_string(key.second) +
                                     "; the newest is " + std::to_string(versions.back()));
  return key;
}

ServedModelPtr ModelStore::pin(const ModelSelector& selector) {
  PendingModelPtr pending;
  {
    const Lock lock(mutex_);
    const auto key = resolve(selector);
    if (const auto slot = slots_.find(key); slot != slots_.end() && slot->second.model) {
      slot->second.last_used = ++uses_;
      return slot->second.model;
    }
    requireStored(key);
    const auto& failure = slots_[key].failure;
    const bool fails_again = failure.load && std::chrono::steady_clock::now() < failure.until &&
                             failure.files == directory_.fingerprint(key.first, signedVersion(key.second));
    pending = fails_again ? failure.load : startLoad(key);
  }
  return pending->get();
}

PendingModelPtr ModelStore::load(const std::string& name, std::uint64_t version) {
  const Lock lock(mutex_);
  return startLoad(requireStored({name, version}));
}

/// Joins a load that runs. Call with the mutex held.
PendingModelPtr ModelStore::startLoad(const Key& key) {
  auto& slot = slots_[key];
  if (slot.pending) return slot.pending;
  slot.pending = std::make_shared<PendingModel>();
  onLoader([this, key, pending = slot.pending] { runLoad(key, pending); });
  return slot.pending;
}

/// Call with the mutex held.
void ModelStore::onLoader(std::function<void()> work) {
  const auto id = ++loads_;
  loaders_.submit(id, {}, 0, [this, id, work = std::move(work)] {
    work();
    loaders_.leave(id);
  });
}

void ModelStore::runLoad(const Key& key, const PendingModelPtr& pending) {
  auto files = directory_.fingerprint(key.first, signedVersion(key.second));
  ServedModelPtr model;
  std::exception_ptr failure;
  // Other failures may pass, so they are tried again: not by those who waited for this one, but after a while.
  auto until = std::chrono::steady_clock::now() + kRetryDelay;
  try {
    model = read(key);
    swapIn(key, model);
  } catch (const FileError&) {
    failure = std::current_exception();
    until = std::chrono::steady_clock::time_point::max();  // or until the files change
  } catch (...) {
    failure = std::current_exception();
  }
  settle(key, {failure ? pending : nullptr, std::move(files), until});
  pending->finish(failure ? nullptr : model, failure);
  changed();
}

ServedModelPtr ModelStore::read(const Key& key) {
  const auto& [name, version] = key;
  {
    const auto manifest = directory_.manifest(name, signedVersion(version));
    const Lock lock(mutex_);
    makeRoom(key, manifest.tensors_bytes);
  }
  const auto stored = directory_.load(name, signedVersion(version));
  auto model = loadShellPga(stored);
  warm(*model);
  const auto bytes = model->bytes();
  return std::make_shared<const ServedModel>(ServedModel{name, version, stored.manifest, std::move(model), bytes});
}

/// Throws OverBudget.
void ModelStore::swapIn(const Key& key, const ServedModelPtr& model) {
  const Lock lock(mutex_);
  if (!slots_.contains(key)) return;  // removed meanwhile: only who waits for it gets it
  makeRoom(key, model->bytes);
  keep(key, model);
}

/// Notes how a load ended.
void ModelStore::settle(const Key& key, Failure failure) {
  const Lock lock(mutex_);
  const auto slot = slots_.find(key);
  if (slot == slots_.end()) return;
  slot->second.pending.reset();
  slot->second.failure = std::move(failure);
}

/// Keeps a model in memory and lets its name stand for it; drops the version it replaces unless a label stands for
/// that. Call with the mutex held.
void ModelStore::keep(const Key& key, ServedModelPtr model) {
  const auto& [name, version] = key;
  const Key before{name, servingVersion(name)};
  auto& newest = newest_[name];
  newest = std::max(newest, version);
  auto& slot = slots_[key];
  slot.model = std::move(model);
  slot.last_used = ++uses_;
  if (before.second == 0 || before.second == servingVersion(name)) return;
  const auto old = slots_.find(before);
  if (old != slots_.end() && !old->second.pending && labelsOf(before).empty()) slots_.erase(old);
}

/// Makes room for a version that is about to be loaded; the one it replaces must not go before it is there. Call with
/// the mutex held. Throws OverBudget.
void ModelStore::makeRoom(const Key& wanted, std::size_t bytes) {
  std::vector<std::map<Key, Slot>::iterator> slots;
  std::vector<Resident> residents;
  for (auto slot = slots_.begin(); slot != slots_.end(); ++slot) {
    if (!slot->second.model) continue;
    const bool held = slot->second.model.use_count() > 1 || slot->first.first == wanted.first;
    residents.push_back({slot->second.model->bytes, slot->second.last_used, held});
    slots.push_back(slot);
  }
  const auto plan = planEviction(residents, bytes, options_.memory_budget);
  if (!plan) throw overBudget(wanted.first, wanted.second, bytes, options_.memory_budget);
  for (const auto index : *plan) slots_.erase(slots[index]);
}

std::vector<std::uint64_t> ModelStore::unload(const std::string& name, std::uint64_t version) {
  std::vector<std::uint64_t> dropped;
  {
    const Lock lock(mutex_);
    requireStored({name, version});
    std::erase_if(slots_, [&](const auto& item) {
      const auto& [key, slot] = item;
      const bool meant = key.first == name && (version == 0 || key.second == version) && slot.model;
      if (meant) dropped.push_back(key.second);
      return meant && !slot.pending;
    });
  }
  changed();
  return dropped;
}

ServedModelPtr ModelStore::ready(const ModelSelector& selector) {
  const Lock lock(mutex_);
  try {
    const auto slot = slots_.find(resolve(selector));
    if (slot != slots_.end() && slot->second.model) return slot->second.model;
  } catch (const ModelNotFound&) {  // it may come
  }
  throw Waiting([this, seen = changes_](Waiting::Resume resume) {
    {
      const Lock again(mutex_);
      if (seen == changes_) return watchers_.push_back(std::move(resume));
    }
    resume();
  });
}

/// Lets everyone who waits for a change look again.
void ModelStore::changed() {
  std::vector<Waiting::Resume> watchers;
  {
    const Lock lock(mutex_);
    ++changes_;
    watchers.swap(watchers_);
  }
  for (const auto& resume : watchers) resume();
}

ModelStore::Standing ModelStore::standing(const std::string& name, std::uint64_t version) const {
  const Lock lock(mutex_);
  return {labelsOf({name, version}), servingVersion(name) == version};
}

std::vector<ModelStore::Entry> ModelStore::list() const {
  std::vector<Entry> entries;
  for (const auto& name : directory_.models())
    for (const auto version : directory_.versions(name)) try {
        entries.push_back({name, static_cast<std::uint64_t>(version), directory_.manifest(name, version), {}, 0, {}});
      } catch (const ModelNotFound&) {  // removed while we looked
      } catch (const FileError&) {      // damaged: asking for it by name says how
      }
  const Lock lock(mutex_);
  for (auto& entry : entries) {
    entry.standing = {labelsOf({entry.name, entry.version}), servingVersion(entry.name) == entry.version};
    const auto found = slots_.find({entry.name, entry.version});
    if (found == slots_.end()) continue;
    const auto& slot = found->second;
    entry.bytes = slot.model ? slot.model->bytes : 0;
    entry.state = slot.model          ? ModelState::kReady
                  : slot.pending      ? ModelState::kLoading
                  : slot.failure.load ? ModelState::kFailed
                                      : ModelState::kStored;
  }
  return entries;
}

std::vector<ServedModelPtr> ModelStore::loaded() const {
  const Lock lock(mutex_);
  std::vector<ServedModelPtr> models;
  for (const auto& [key, slot] : slots_)
    if (slot.model) models.push_back(slot.model);
  return models;
}

ServedModelPtr ModelStore::publish(const std::string& name, ShellPgaModelPtr model, const Provenance& provenance) {
  const auto version = publishShellPga(directory_, name, *model, toJson(provenance));
  return served({name, static_cast<std::uint64_t>(version)}, directory_.manifest(name, version), std::move(model));
}

/// A version that was published just now, in memory if the budget allows.
ServedModelPtr ModelStore::served(const Key& key, ModelManifest manifest, ShellPgaModelPtr model) {
  const auto& [name, version] = key;
  const auto bytes = model->bytes();
  auto served =
      std::make_shared<const ServedModel>(ServedModel{name, version, std::move(manifest), std::move(model), bytes});
  {
    const Lock lock(mutex_);
    try {
      makeRoom(key, bytes);
      keep(key, served);
    } catch (const OverBudget&) {  // it is published all the same, and loaded when wanted
      newest_[name] = std::max(newest_[name], version);
    }
  }
  changed();
  return served;
}

std::unique_ptr<IncomingModel> ModelStore::receive(const std::string& name, std::string manifest_text) const {
  auto incoming = directory_.receive(name, std::move(manifest_text));
  requireShellPga(incoming->manifest());
  if (const auto bytes = incoming->manifest().tensors_bytes; bytes > options_.memory_budget)
    throw overBudget(name, 0, bytes, options_.memory_budget);
  return incoming;
}

PendingModelPtr ModelStore::publish(std::unique_ptr<IncomingModel> incoming, std::stop_token stop) {
  auto pending = std::make_shared<PendingModel>();
  auto work = [this, pending, stop = std::move(stop), files = std::shared_ptr(std::move(incoming))]() mutable {
    ServedModelPtr model;
    std::exception_ptr failure;
    try {
      model = takeIn(*files, stop);
    } catch (...) {
      failure = std::current_exception();
    }
    files.reset();  // who is told of a failure finds nothing left
    pending->finish(std::move(model), failure);
  };
  const Lock lock(mutex_);
  onLoader(std::move(work));
  return pending;
}

ServedModelPtr ModelStore::takeIn(IncomingModel& incoming, const std::stop_token& stop) {
  const auto tensors = incoming.finish();
  {
    const Lock lock(mutex_);
    makeRoom({incoming.name(), 0}, incoming.manifest().tensors_bytes);
  }
  auto model = shellPgaFrom(incoming.manifest(), *tensors);
  warm(*model);
  {
    const Lock lock(mutex_);
    makeRoom({incoming.name(), 0}, model->bytes());
  }
  if (stop.stop_requested()) throw Stopped();
  const auto version = directory_.publish(incoming);
  return served({incoming.name(), static_cast<std::uint64_t>(version)}, incoming.manifest(), std::move(model));
}

ModelFiles ModelStore::files(const ModelSelector& selector) const {
  Key key;
  {
    const Lock lock(mutex_);
    key = resolve(selector);
  }
  return directory_.files(key.first, signedVersion(key.second));
}

std::uint64_t ModelStore::publishedBy(const std::string& name, const std::string& job_key) const {
  for (const auto version : directory_.versions(name)) try {
      if (provenanceOf(directory_.manifest(name, version)).job_key == job_key)
        return static_cast<std::uint64_t>(version);
    } catch (const ModelNotFound&) {  // removed while we looked
    } catch (const FileError&) {      // damaged: whose it was cannot be told
    }
  return 0;
}

std::vector<std::uint64_t> ModelStore::remove(const std::string& name, std::uint64_t version) {
  std::vector<std::uint64_t> removed;
  const Lock lock(mutex_);
  if (version != 0) {
    if (const auto labels = labelsOf({name, version}); !labels.empty())
      throw WrongState("version " + std::to_string(version) + " of \"" + name + "\" is labelled \"" + labels.front() +
                       "\"; move the label first, or delete the whole model");
    directory_.remove(name, signedVersion(version));
    removed.push_back(version);
  } else {
    for (const auto each : directory_.versions(name)) removed.push_back(static_cast<std::uint64_t>(each));
    directory_.remove(name);
    labels_.erase(name);
  }
  for (const auto each : removed) slots_.erase({name, each});
  if (const auto left = directory_.versions(name); left.empty())
    newest_.erase(name);
  else if (newest_[name] == version)
    newest_[name] = static_cast<std::uint64_t>(left.back());
  return removed;
}

void ModelStore::setLabel(const std::string& name, const std::string& label, std::uint64_t version) {
  const Lock lock(mutex_);
  directory_.setLabel(name, label, signedVersion(version));
  if (version == 0)
    labels_[name].erase(label);
  else
    labels_[name][label] = version;
}

}  // namespace shaped::server
