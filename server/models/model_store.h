#pragma once

#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <set>
#include <stop_token>
#include <string>
#include <vector>

#include "server/models/pending_model.h"
#include "server/models/version_table.h"
#include "server/scheduling/worker_pool.h"

namespace shaped::server {

enum class ModelState {
  kStored,   ///< on the disk; loaded when a request wants it
  kLoading,  ///< on its way into memory
  kReady,    ///< in memory
  kFailed,   ///< its last load failed; the next tries again once its files have changed, or on load()
};

struct ModelStoreOptions {
  std::size_t memory_budget = std::size_t{4} << 30;  ///< of models in memory [bytes]
  int loaders = 2;                                   ///< threads that load, so that one bad model delays no other, >= 1
};

/// The models under <root>/<name>/<version>/, and those of them that are in memory. Safe from any thread.
///
/// A version comes into memory when it is published, asked for by load(), or wanted by a request: its files are
/// verified, the model is built and warmed, and only then does it replace the one before; who holds that one keeps it.
/// Models that no request holds are dropped, the least recently used first, when the memory budget would be exceeded.
///
/// Without a version or label a name stands for its "stable" version, where that label is set, else for the newest
/// version known: at start the newest on the disk, then what was published or loaded here. What another process puts
/// into the store counts once it is loaded, by load() or because look() was called.
class ModelStore {
 public:
  explicit ModelStore(const std::filesystem::path& root, const ModelStoreOptions& options = {});

  /// The model, held as long as the pointer lives. When it is not in memory, starts to load it and throws Waiting.
  /// Throws ModelNotFound; InvalidInput for a bad name or a selector with version and label; what its load threw:
  /// FileError when files are damaged, at once until they change, OverBudget when it does not fit into memory.
  ServedModelPtr pin(const ModelSelector& selector);
  /// As pin(), but gives the load to wait for; one that has ended when the model is in memory.
  PendingModelPtr fetch(const ModelSelector& selector);
  /// Starts to load a version from the disk, whether or not it is in memory; 0: the newest on the disk. Its name stands
  /// for it afterwards unless it stood for a newer one. Throws ModelNotFound, InvalidInput for a bad name.
  PendingModelPtr load(const std::string& name, std::uint64_t version);
  /// Drops a version from memory, or all of a name (0); returns those dropped. Requests that hold it finish.
  /// Throws ModelNotFound.
  std::vector<std::uint64_t> unload(const std::string& name, std::uint64_t version);
  /// The model once it is in memory, without loading it. Throws Waiting until then; InvalidInput as pin().
  ServedModelPtr ready(const ModelSelector& selector);

  /// What stands for a version.
  struct Standing {
    std::vector<std::string> labels;
    bool serving = false;  ///< whether its name alone does
  };
  Standing standing(const std::string& name, std::uint64_t version) const;

  /// A version without its tensors.
  struct Entry {
    std::string name;
    std::uint64_t version = 0;
    ModelManifest manifest;
    ModelState state = ModelState::kStored;
    std::size_t bytes = 0;  ///< in memory; 0: not there
    Standing standing;
  };
  /// All versions by name and number, without loading any. A version whose manifest is damaged is left out.
  std::vector<Entry> list() const;
  /// The models in memory, by name and version.
  std::vector<ServedModelPtr> loaded() const;

  /// Writes a new version, for which its name stands afterwards; it is in memory if the budget allows. Throws FileError
  /// when the disk fails: nothing is left behind.
  ServedModelPtr publish(const std::string& name, ShapeModelPtr model, const Provenance& provenance);
  /// Takes in a version from elsewhere (ModelDirectory::receive). Throws OverBudget when it can never fit into memory.
  std::unique_ptr<IncomingModel> receive(const std::string& name, std::string manifest_text) const;
  /// Starts to verify, build and warm what has come, and then publishes it as publish() does. The load throws
  /// InvalidInput when it is no model, OverBudget, FileError; Stopped when the token fires before it is published: in
  /// each case nothing is left behind.
  PendingModelPtr publish(std::unique_ptr<IncomingModel> incoming, std::stop_token stop);
  /// The files of a version, without loading it. Throws ModelNotFound, InvalidInput as pin(); FileError.
  ModelFiles files(const ModelSelector& selector) const;
  /// What another process changed in a model's folder.
  struct Changes {
    std::vector<std::uint64_t> gone;  ///< that were in memory or the newest known
    std::uint64_t appeared = 0;       ///< newer than the newest known; 0: none
    PendingModelPtr load;             ///< its load, begun; null where none has appeared
  };
  /// Looks at a model's folder: drops what has gone, and starts to load the newest whole version if it is newer than
  /// the one known. Versions that failed are passed over until their files change; those that are not whole, too. Waits
  /// while a version of the name is being published here.
  Changes look(const std::string& name);
  /// Of the models in the store, sorted.
  std::vector<std::string> names() const { return directory_.models(); }
  /// The version of a name that a job of this key has published; 0: none.
  std::uint64_t publishedBy(const std::string& name, const std::string& job_key) const;
  /// Removes one version, or all (0); returns the versions removed. Throws ModelNotFound; WrongState when a label
  /// stands for the one version; FileError when the disk fails.
  std::vector<std::uint64_t> remove(const std::string& name, std::uint64_t version);
  /// Lets a label stand for a version, or for none (0); on the disk when it returns. Throws ModelNotFound, InvalidInput
  /// for a bad label, FileError.
  void setLabel(const std::string& name, const std::string& label, std::uint64_t version);

 private:
  using Key = ModelKey;
  class Publishing;
  /// How the last load ended, when it failed: who asks again before the files change or the time is up fails alike.
  struct Failure {
    PendingModelPtr load;
    std::string files;  ///< their fingerprint
    std::chrono::steady_clock::time_point until;
  };
  struct Slot {
    ServedModelPtr model;     ///< once ready
    PendingModelPtr pending;  ///< while it loads
    Failure failure;
    std::uint64_t last_used = 0;
  };

  Key resolve(const ModelSelector& selector) const;
  Key requireStored(Key key) const;
  PendingModelPtr startLoad(const Key& key);
  void onLoader(std::function<void()> work);
  std::vector<std::uint64_t> dropMissing(const std::string& name, const std::vector<std::uint64_t>& left);
  ServedModelPtr inMemory(const Key& key);
  PendingModelPtr startWanted(const Key& key);
  bool whole(const Key& key) const;
  void runLoad(const Key& key, const PendingModelPtr& pending);
  ServedModelPtr read(const Key& key);
  ServedModelPtr takeIn(IncomingModel& incoming, const std::stop_token& stop);
  ServedModelPtr served(const Key& key, ModelManifest manifest, ShapeModelPtr model);
  void swapIn(const Key& key, const ServedModelPtr& model);
  void settle(const Key& key, Failure failure);
  void keep(const Key& key, ServedModelPtr model);
  void makeRoom(const Key& wanted, std::size_t bytes);
  void changed();

  const ModelDirectory directory_;
  const ModelStoreOptions options_;
  mutable std::mutex mutex_;
  std::map<Key, Slot> slots_;
  VersionTable table_;
  std::multiset<std::string> publishing_;  ///< names that get a version here at the moment
  std::condition_variable published_;
  std::vector<Waiting::Resume> watchers_;  ///< of ready()
  std::uint64_t uses_ = 0, loads_ = 0, changes_ = 0;
  WorkerPool loaders_;  // last: its threads use what stands above
};

}  // namespace shaped::server
