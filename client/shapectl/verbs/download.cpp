#include <iostream>

#include "client/model_transfer.h"
#include "client/shapectl/output.h"
#include "client/shapectl/progress_bar.h"
#include "client/shapectl/verbs/verbs.h"

namespace shaped::shapectl {
namespace {

struct Download {
  std::string name, folder;

  void declare(Arguments& arguments) {
    arguments.positional("NAME", name, "The model, NAME, NAME@VERSION or NAME@LABEL");
    arguments.positional("DEST", folder, "The folder to make, for manifest.json and tensors.safetensors");
  }

  ExitCode run(const Session& session) const {
    const auto version = fetch(session);
    if (session.json) {
      nlohmann::json document{{"folder", folder}};
      addModel(document, version);
      printJson(document);
    } else
      std::cout << "downloaded " << modelText(version) << " to " << folder << "\n";
    return ExitCode::kSuccess;
  }

 private:
  v1::ModelVersion fetch(const Session& session) const {
    ProgressBar bar;
    return client::downloadModel(session.channel(), parseModel(name), folder, session.callOptions(),
                                 [&bar](double fraction) { bar.show(fraction, "downloading"); });
  }
};

}  // namespace

Verb downloadVerb() {
  return makeVerb<Download>("download", "Fetch a model's files from the daemon into a new folder");
}

}  // namespace shaped::shapectl
