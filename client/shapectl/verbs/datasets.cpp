#include <iostream>

#include "client/scan_upload.h"
#include "client/shapectl/output.h"
#include "client/shapectl/verbs/verbs.h"

namespace shaped::shapectl {
namespace {

nlohmann::json toJson(const v1::Dataset& dataset) {
  const bool scans = dataset.kind() == v1::DATASET_KIND_SCANS;
  nlohmann::json document{{"name", dataset.name()},
                          {"kind", scans ? "scans" : "shapes"},
                          {"frames", dataset.frames()},
                          {"created", timeText(dataset.created())}};
  if (!scans)
    document.update({{"vertices", dataset.vertex_count()},
                     {"faces", dataset.face_count()},
                     {"topology_id", dataset.topology_id()}});
  return document;
}

void printText(const v1::Dataset& dataset) {
  const bool scans = dataset.kind() == v1::DATASET_KIND_SCANS;
  std::cout << dataset.name() << "  " << dataset.frames() << (scans ? " scans" : " shapes of ");
  if (!scans) std::cout << dataset.vertex_count() << " vertices";
  std::cout << "  " << timeText(dataset.created()) << "\n";
}

struct Datasets {
  void declare(Arguments&) {}

  ExitCode run(const Session& session) const {
    auto documents = nlohmann::json::array();
    for (const auto& dataset : client::listDatasets(session.channel(), session.callOptions())) {
      if (!session.json) printText(dataset);
      documents.push_back(toJson(dataset));
    }
    if (session.json) printJson({{"datasets", documents}});
    return ExitCode::kSuccess;
  }
};

struct DeleteDataset {
  std::string name;

  void declare(Arguments& arguments) {
    arguments.positional("NAME", name, "The dataset, as `shapectl datasets` lists it");
  }

  ExitCode run(const Session& session) const {
    client::deleteDataset(session.channel(), name, session.callOptions());
    if (session.json)
      printJson({{"deleted", name}});
    else
      std::cout << "deleted dataset " << name << "\n";
    return ExitCode::kSuccess;
  }
};

}  // namespace

Verb datasetsVerb() { return makeVerb<Datasets>("datasets", "List the shapes and scans that the daemon keeps"); }
Verb deleteDatasetVerb() {
  return makeVerb<DeleteDataset>("delete-dataset", "Delete a dataset; models and jobs that have it stay");
}

}  // namespace shaped::shapectl
