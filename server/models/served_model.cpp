#include "server/models/served_model.h"

#include "core/io/json_fields.h"

namespace shaped::server {
namespace {

constexpr const char* kDataset = "dataset";
constexpr const char *kJob = "job", *kJobKey = "job_key";
constexpr const char* kCreated = "created";      // seconds since 1970
constexpr std::int64_t kLatest = 9'000'000'000;  // of them: what the clock's nanoseconds can hold

/// Empty where it is missing or no text: who loads the model says what is wrong with it.
std::string textIn(const nlohmann::json& object, const char* field) {
  const auto found = object.find(field);
  return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

}  // namespace

nlohmann::json toJson(const Provenance& provenance) {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(provenance.created.time_since_epoch());
  nlohmann::json json{{kDataset, provenance.dataset}, {kCreated, seconds.count()}};
  if (!provenance.job_key.empty()) json.update({{kJob, provenance.job}, {kJobKey, provenance.job_key}});
  return json;
}

Provenance provenanceOf(const ModelManifest& manifest) {
  // Models from elsewhere have none.
  const auto found = manifest.description.find("provenance");
  if (found == manifest.description.end() || !found->is_object()) return {};
  const auto created = wholeNumber(*found, kCreated, 0, kLatest).value_or(0);
  return {textIn(*found, kDataset), std::chrono::system_clock::time_point(std::chrono::seconds(created)),
          textIn(*found, kJob), textIn(*found, kJobKey)};
}

}  // namespace shaped::server
