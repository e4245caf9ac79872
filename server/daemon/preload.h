#pragma once

#include <functional>
#include <memory>

#include "server/daemon/preload_list.h"
#include "server/models/model_store.h"

namespace shaped::server {

/// Brings models into memory, side by side, and logs what becomes of each. They stay at least until all have come.
class Preload {
 public:
  /// done: called once, from any thread, perhaps before this returns: when each is in memory or has failed.
  Preload(ModelStore& store, const PreloadList& wanted, std::function<void()> done);
  /// Nothing is called any more; loads that run go on.
  ~Preload();
  Preload(const Preload&) = delete;
  Preload& operator=(const Preload&) = delete;

 private:
  class Progress;
  std::shared_ptr<Progress> progress_;
};

}  // namespace shaped::server
