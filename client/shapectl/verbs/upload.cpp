#include <iostream>

#include "client/model_transfer.h"
#include "client/shapectl/model_output.h"
#include "client/shapectl/output.h"
#include "client/shapectl/progress_bar.h"
#include "client/shapectl/verbs/verbs.h"

namespace shaped::shapectl {
namespace {

struct Upload {
  std::string name, folder;

  void declare(Arguments& arguments) {
    arguments.positional("NAME", name, "The model that gets a new version");
    arguments.positional("SOURCE", folder, "A folder that download made: manifest.json and tensors.safetensors");
  }

  ExitCode run(const Session& session) const {
    const auto description = send(session);
    if (session.json)
      printJson(toJson(description));
    else
      std::cout << "uploaded " << folder << " as " << modelText(description.model()) << "\n";
    return ExitCode::kSuccess;
  }

 private:
  v1::ModelDescription send(const Session& session) const {
    ProgressBar bar;
    return client::uploadModel(session.channel(), name, folder, session.callOptions(), [&bar](double fraction) {
      bar.show(fraction, fraction < 1 ? "uploading" : "verifying");
    });
  }
};

}  // namespace

Verb uploadVerb() { return makeVerb<Upload>("upload", "Bring a model's files to the daemon, as a new version"); }

}  // namespace shaped::shapectl
