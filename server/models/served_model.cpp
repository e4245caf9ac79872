#include "server/models/served_model.h"

#include "core/io/json_fields.h"

namespace shaped::server {
namespace {

constexpr const char* kDataset = "dataset";
constexpr const char* kCreated = "created";      // seconds since 1970
constexpr std::int64_t kLatest = 9'000'000'000;  // of them: what the clock's nanoseconds can hold

}  // namespace

nlohmann::json toJson(const Provenance& provenance) {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(provenance.created.time_since_epoch());
  return {{kDataset, provenance.dataset}, {kCreated, seconds.count()}};
}

Provenance provenanceOf(const ModelManifest& manifest) {
  // Models from elsewhere have none.
  const auto found = manifest.description.find("provenance");
  if (found == manifest.description.end() || !found->is_object()) return {};
  const auto dataset = found->find(kDataset);
  const auto created = wholeNumber(*found, kCreated, 0, kLatest).value_or(0);
  return {dataset != found->end() && dataset->is_string() ? dataset->get<std::string>() : "",
          std::chrono::system_clock::time_point(std::chrono::seconds(created))};
}

}  // namespace shaped::server
