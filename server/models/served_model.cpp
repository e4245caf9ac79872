#include "server/models/served_model.h"

namespace shaped::server {
namespace {

constexpr const char* kDataset = "dataset";
constexpr const char* kCreated = "created";  // seconds since 1970

}  // namespace

nlohmann::json toJson(const Provenance& provenance) {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(provenance.created.time_since_epoch());
  return {{kDataset, provenance.dataset}, {kCreated, seconds.count()}};
}

Provenance provenanceOf(const ModelManifest& manifest) {
  // Models from elsewhere have none.
  const auto found = manifest.description.find("provenance");
  if (found == manifest.description.end() || !found->is_object()) return {};
  return {found->value(kDataset, ""),
          std::chrono::system_clock::time_point(std::chrono::seconds(found->value(kCreated, std::int64_t{0})))};
}

}  // namespace shaped::server
