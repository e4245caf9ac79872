#pragma once

#include <memory>
#include <mutex>

#include "server/models/folder_watch.h"
#include "server/models/model_store.h"

namespace shaped::server {

/// --model-policy watch: versions that another process renames into the store are loaded, those that it removes are
/// dropped, and the log says so.
class ModelWatch {
 public:
  /// folder: the store's, <store>/models. Throws FileError when it cannot be watched.
  ModelWatch(ModelStore& store, const std::filesystem::path& folder);
  ~ModelWatch();
  ModelWatch(const ModelWatch&) = delete;
  ModelWatch& operator=(const ModelWatch&) = delete;

 private:
  /// What loads have of the watch, which may be gone when they end.
  struct Link {
    std::recursive_mutex mutex;  ///< a look may end a load, which causes the next look
    ModelWatch* watch;
  };

  void look(const std::string& name);

  ModelStore& store_;
  const std::shared_ptr<Link> link_;
  FolderWatch watch_;  // last: its thread uses what stands above
};

}  // namespace shaped::server
