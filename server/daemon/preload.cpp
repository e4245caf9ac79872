#include "server/daemon/preload.h"

#include <algorithm>
#include <mutex>

#include "core/numerics/error.h"
#include "server/telemetry/call_log.h"

namespace shaped::server {
namespace {

std::string textOf(const ModelSelector& selector) {
  if (selector.version != 0) return selector.name + "@" + std::to_string(selector.version);
  return selector.label.empty() ? selector.name : selector.name + "@" + selector.label;
}

}  // namespace

/// Counts what has ended, and the beginning of it all as one more. Shared with loads, which may outlive the Preload.
class Preload::Progress {
 public:
  Progress(std::size_t count, std::function<void()> done) : left_(count + 1), total_(count), done_(std::move(done)) {}

  void ended(ServedModelPtr model) {
    const std::scoped_lock lock(mutex_);
    if (model) models_.push_back(std::move(model));
    if (--left_ > 0 || !done_) return;
    if (total_ > 0)
      logInfo("preload: " + std::to_string(models_.size()) + " of " + std::to_string(total_) + " models are in memory");
    done_();
    done_ = nullptr;
    models_.clear();
  }
  void forget() {
    const std::scoped_lock lock(mutex_);
    done_ = nullptr;
    models_.clear();
  }

 private:
  std::mutex mutex_;
  std::size_t left_;
  const std::size_t total_;
  std::function<void()> done_;
  std::vector<ServedModelPtr> models_;  ///< none may push another out of the memory budget
};

namespace {

/// Runs a step that may throw; null, and a line in the log, when it does.
template <class Result>
Result logged(const ModelSelector& selector, const std::function<Result()>& step) {
  try {
    return step();
  } catch (const std::exception& problem) {
    logError("preload: " + textOf(selector) + " is not in memory: " + problem.what());
    return nullptr;
  }
}

}  // namespace

Preload::Preload(ModelStore& store, const PreloadList& wanted, std::function<void()> done) {
  auto models = wanted.models;
  if (wanted.all)
    for (const auto& name : store.names()) models.push_back({name, 0, ""});
  progress_ = std::make_shared<Progress>(models.size(), std::move(done));
  for (const auto& selector : models) {
    const auto load = logged<PendingModelPtr>(selector, [&] { return store.fetch(selector); });
    if (!load) {
      progress_->ended(nullptr);
      continue;
    }
    load->whenDone([progress = progress_, load, selector] {
      progress->ended(logged<ServedModelPtr>(selector, [&] { return load->get(); }));
    });
  }
  progress_->ended(nullptr);  // that all have been begun
}

Preload::~Preload() { progress_->forget(); }

}  // namespace shaped::server
