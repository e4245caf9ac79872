#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "core/io/model_directory.h"
#include "core/model/shape_model.h"

namespace shaped::server {

/// A model in memory: one version, immutable. Whoever holds the pointer keeps it, whatever happens to the store.
struct ServedModel {
  std::string name;
  std::uint64_t version = 0;
  ModelManifest manifest;
  ShapeModelPtr shapes;   ///< what it answers with
  std::size_t bytes = 0;  ///< of memory, about
};
using ServedModelPtr = std::shared_ptr<const ServedModel>;

/// Which model a request wants.
struct ModelSelector {
  std::string name;
  std::uint64_t version = 0;  ///< 0: as the label says
  std::string label;          ///< empty: "stable" where there is one, else the newest version
};

/// Where a model came from; kept in its manifest.
struct Provenance {
  std::string dataset;
  std::chrono::system_clock::time_point created;
  std::string job, job_key;  ///< the job that made it, and its key; empty: none
};
Provenance provenanceOf(const ModelManifest& manifest);
nlohmann::json toJson(const Provenance& provenance);

}  // namespace shaped::server
