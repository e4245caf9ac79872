#include "server/models/model_store.h"

#include <algorithm>

#include "core/io/file_error.h"
#include "core/model/model_kinds.h"
#include "server/errors/errors.h"
#include "server/models/eviction.h"

namespace shaped::server {
namespace {

constexpr std::chrono::seconds kRetryDelay(1);

using Lock = std::scoped_lock<std::mutex>;

std::int64_t signedVersion(std::uint64_t version) { return static_cast<std::int64_t>(version); }

std::vector<std::uint64_t> unsignedVersions(const std::vector<std::int64_t>& versions) {
  return {versions.begin(), versions.end()};
}

std::string megabytes(std::size_t bytes) { return std::to_string((bytes + (1 << 20) - 1) >> 20) + " MiB"; }

PendingModelPtr ended(ServedModelPtr model) {
  auto pending = std::make_shared<PendingModel>();
  pending->finish(std::move(model), nullptr);
  return pending;
}

/// version: 0 for one that has no number yet.
OverBudget overBudget(const std::string& name, std::uint64_t version, std::size_t bytes, std::size_t budget) {
  return {"model \"" + name + "\"" + (version == 0 ? "" : " version " + std::to_string(version)) + " needs " +
              megabytes(bytes) + " of memory, which the budget of " + megabytes(budget) +
              " for models does not have; unload others or raise --model-megabytes",
          bytes <= budget};
}

}  // namespace

/// Keeps look() from a version that is being published here, which would be loaded a second time.
class ModelStore::Publishing {
 public:
  Publishing(ModelStore& store, const std::string& name) : store_(store) {
    const Lock lock(store_.mutex_);
    place_ = store_.publishing_.insert(name);
  }
  ~Publishing() {
    {
      const Lock lock(store_.mutex_);
      store_.publishing_.erase(place_);
    }
    store_.published_.notify_all();
  }
  Publishing(const Publishing&) = delete;
  Publishing& operator=(const Publishing&) = delete;

 private:
  ModelStore& store_;
  std::multiset<std::string>::iterator place_;
};

ModelStore::ModelStore(const std::filesystem::path& root, const ModelStoreOptions& options)
    : directory_(root), options_(options), loaders_("loader", options.loaders, noLimits(), {}) {
  loaders_.hireFirst();  // else a training, which gives way to all others, might be the one to start it
  for (const auto& name : directory_.models()) {
    table_.add({name, unsignedVersions(directory_.versions(name)).back()});
    for (const auto& [label, version] : directory_.labels(name))
      table_.setLabel(name, label, static_cast<std::uint64_t>(version));
  }
}

/// Call with the mutex held.
ModelStore::Key ModelStore::resolve(const ModelSelector& selector) const {
  if (const auto key = table_.resolve(selector)) return *key;
  directory_.versions(selector.name);  // throws for a bad name
  throw ModelNotFound("model", "there is no model \"" + selector.name + "\"");
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
  std::optional<Key> key;
  {
    const Lock lock(mutex_);
    key = resolve(selector);
    if (auto model = inMemory(*key)) return model;
  }
  return startWanted(*key)->get();
}

PendingModelPtr ModelStore::fetch(const ModelSelector& selector) {
  std::optional<Key> key;
  {
    const Lock lock(mutex_);
    key = resolve(selector);
    if (auto model = inMemory(*key)) return ended(std::move(model));
  }
  return startWanted(*key);
}

/// Call with the mutex held.
ServedModelPtr ModelStore::inMemory(const Key& key) {
  const auto slot = slots_.find(key);
  if (slot == slots_.end() || !slot->second.model) return nullptr;
  slot->second.last_used = ++uses_;
  return slot->second.model;
}

/// Looks into the folder without the mutex: a disk that hangs holds up who wants this model, and nobody else.
PendingModelPtr ModelStore::startWanted(const Key& key) {
  requireStored(key);
  const auto files = directory_.fingerprint(key.first, signedVersion(key.second));
  const Lock lock(mutex_);
  if (auto model = inMemory(key)) return ended(std::move(model));  // it has come meanwhile
  const auto& failure = slots_[key].failure;
  const bool fails_again = failure.load && std::chrono::steady_clock::now() < failure.until && failure.files == files;
  return fails_again ? failure.load : startLoad(key);
}

PendingModelPtr ModelStore::load(const std::string& name, std::uint64_t version) {
  const auto key = requireStored({name, version});
  const Lock lock(mutex_);
  return startLoad(key);
}

/// Joins a load that runs. Call with the mutex held.
PendingModelPtr ModelStore::startLoad(const Key& key) {
  auto& slot = slots_[key];
  if (slot.pending) return slot.pending;
  const auto pending = std::make_shared<PendingModel>();
  onLoader([this, key, pending] { runLoad(key, pending); });
  slot.pending = pending;  // only now: without a loader nobody would ever end it
  return pending;
}

/// Call with the mutex held.
void ModelStore::onLoader(std::function<void()> work) {
  const auto id = ++loads_;
  const auto decision = loaders_.submit(id, {}, 0, [this, id, work = std::move(work)] {
    work();
    loaders_.leave(id);
  });
  if (!decision.admitted) throw std::bad_alloc();  // no limits: there is no thread to be had
}

void ModelStore::runLoad(const Key& key, const PendingModelPtr& pending) {
  auto files = directory_.fingerprint(key.first, signedVersion(key.second));
  ServedModelPtr model;
  std::exception_ptr failure;
  auto until = std::chrono::steady_clock::time_point::max();  // or until the files change
  try {
    model = read(key);
    swapIn(key, model);
  } catch (const FileError&) {
    failure = std::current_exception();
  } catch (...) {
    failure = std::current_exception();
    // What may pass is tried again: not by those who waited for this load, but after a while.
    until = std::chrono::steady_clock::now() + kRetryDelay;
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
  ShapeModelPtr model;
  const auto stored = directory_.load(name, signedVersion(version), [&](const StoredModel& unverified) {
    model = loadShapeModel(unverified);
    model->warm();
  });
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
  const auto& name = key.first;
  const Key before{name, table_.serving(name)};
  table_.add(key);
  auto& slot = slots_[key];
  slot.model = std::move(model);
  slot.last_used = ++uses_;
  if (before.second == 0 || before.second == table_.serving(name)) return;
  const auto old = slots_.find(before);
  if (old != slots_.end() && !old->second.pending && table_.labelsOf(before).empty()) slots_.erase(old);
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
  requireStored({name, version});
  {
    const Lock lock(mutex_);
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
  return {table_.labelsOf({name, version}), table_.serving(name) == version};
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
    entry.standing = {table_.labelsOf({entry.name, entry.version}), table_.serving(entry.name) == entry.version};
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

ServedModelPtr ModelStore::publish(const std::string& name, ShapeModelPtr model, const Provenance& provenance) {
  const Publishing publishing(*this, name);
  const auto version = model->publish(directory_, name, toJson(provenance));
  return served({name, static_cast<std::uint64_t>(version)}, directory_.manifest(name, version), std::move(model));
}

/// A version that was published just now, in memory if the budget allows.
ServedModelPtr ModelStore::served(const Key& key, ModelManifest manifest, ShapeModelPtr model) {
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
      table_.add(key);
    }
  }
  changed();
  return served;
}

std::unique_ptr<IncomingModel> ModelStore::receive(const std::string& name, std::string manifest_text) const {
  auto incoming = directory_.receive(name, std::move(manifest_text));
  requireServable(incoming->manifest());
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
  auto model = shapeModelFrom(incoming.manifest(), tensors);
  model->warm();
  {
    const Lock lock(mutex_);
    makeRoom({incoming.name(), 0}, model->bytes());
  }
  if (stop.stop_requested()) throw Stopped();
  const Publishing publishing(*this, incoming.name());
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
    if (const auto labels = table_.labelsOf({name, version}); !labels.empty())
      throw WrongState("version " + std::to_string(version) + " of \"" + name + "\" is labelled \"" + labels.front() +
                       "\"; move the label first, or delete the whole model");
    directory_.remove(name, signedVersion(version));
    removed.push_back(version);
  } else {
    removed = unsignedVersions(directory_.versions(name));
    directory_.remove(name);
  }
  const auto left = unsignedVersions(directory_.versions(name));
  dropMissing(name, left);
  // Of what another process put there, the newest: something must be left for the name to stand for.
  if (table_.newest(name) == 0 && !left.empty()) table_.add({name, left.back()});
  return removed;
}

void ModelStore::setLabel(const std::string& name, const std::string& label, std::uint64_t version) {
  const Lock lock(mutex_);
  directory_.setLabel(name, label, signedVersion(version));
  table_.setLabel(name, label, version);
}

/// Forgets what is not among the versions left of a name; returns what was in memory or the newest known. Call with the
/// mutex held.
std::vector<std::uint64_t> ModelStore::dropMissing(const std::string& name, const std::vector<std::uint64_t>& left) {
  const auto missing = [&](std::uint64_t version) {
    return version != 0 && !std::binary_search(left.begin(), left.end(), version);
  };
  std::set<std::uint64_t> gone;
  if (const auto newest = table_.newest(name); missing(newest)) gone.insert(newest);
  std::erase_if(slots_, [&](const auto& item) {
    const auto& [key, slot] = item;
    const bool meant = key.first == name && missing(key.second);
    if (meant && slot.model) gone.insert(key.second);
    return meant;
  });
  table_.keepOnly(name, left);
  return {gone.begin(), gone.end()};
}

/// Whether a version's files are there, as long as they should be. Publishing by rename makes it so in one step.
bool ModelStore::whole(const Key& key) const try {
  directory_.files(key.first, signedVersion(key.second));
  return true;
} catch (const std::exception&) {
  return false;
}

ModelStore::Changes ModelStore::look(const std::string& name) {
  Changes changes;
  std::vector<std::uint64_t> candidates;
  {
    std::unique_lock lock(mutex_);
    published_.wait(lock, [&] { return !publishing_.contains(name); });
    const auto versions = unsignedVersions(directory_.versions(name));
    changes.gone = dropMissing(name, versions);
    candidates.assign(std::upper_bound(versions.begin(), versions.end(), table_.newest(name)), versions.end());
  }
  for (auto version = candidates.rbegin(); version != candidates.rend(); ++version) {
    const Key key{name, *version};
    if (!whole(key)) continue;
    const auto files = directory_.fingerprint(name, signedVersion(*version));
    const Lock lock(mutex_);
    const auto& failure = slots_[key].failure;
    if (failure.load && failure.files == files) continue;
    changes.appeared = *version;
    changes.load = startLoad(key);
    break;
  }
  if (!changes.gone.empty()) changed();
  return changes;
}

}  // namespace shaped::server
