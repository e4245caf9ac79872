#include "server/daemon/model_watch.h"

#include "server/telemetry/call_log.h"

namespace shaped::server {
namespace {

std::string textOf(const std::string& name, std::uint64_t version) { return name + "@" + std::to_string(version); }

}  // namespace

ModelWatch::ModelWatch(ModelStore& store, const std::filesystem::path& folder)
    : store_(store),
      link_(new Link{{}, this}),
      watch_(folder, {[this](const std::string& name) { look(name); },
                      [](const std::string& text) { logWarning("model watch: " + text); }}) {}

ModelWatch::~ModelWatch() {
  const std::scoped_lock lock(link_->mutex);
  link_->watch = nullptr;
}

void ModelWatch::look(const std::string& name) try {
  const auto changes = store_.look(name);
  for (const auto version : changes.gone) logInfo("model watch: " + textOf(name, version) + " has gone from the store");
  if (!changes.load) return;
  const auto version = changes.appeared;
  logInfo("model watch: " + textOf(name, version) + " has appeared, loading it");
  const auto load = changes.load;
  load->whenDone([link = link_, load, name, version] {
    try {
      load->get();
      logInfo("model watch: " + textOf(name, version) + " is in memory");
    } catch (const std::exception& problem) {
      logError("model watch: " + textOf(name, version) + " is not served: " + problem.what());
      const std::scoped_lock lock(link->mutex);
      if (link->watch) link->watch->look(name);  // of several that appeared at once, an older one may do
    }
  });
} catch (const std::exception& problem) {  // a folder that has no model's name, a disk that fails
  logWarning("model watch: \"" + name + "\" is left alone: " + problem.what());
}

}  // namespace shaped::server
