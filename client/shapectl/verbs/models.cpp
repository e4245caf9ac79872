#include <iomanip>
#include <iostream>

#include "client/shapectl/model_output.h"
#include "client/shapectl/output.h"
#include "client/shapectl/verbs/verbs.h"
#include "shaped/v1/models.grpc.pb.h"

namespace shaped::shapectl {
namespace {

struct Models {
  void declare(Arguments&) {}

  ExitCode run(const Session& session) const {
    const auto stub = v1::Models::NewStub(session.channel());
    client::Call call(session.callOptions());
    v1::ListModelsResponse response;
    client::require(stub->List(call.context(), {}, &response));
    session.json ? printDocument(response) : printTable(response);
    return ExitCode::kSuccess;
  }

  static void printDocument(const v1::ListModelsResponse& response) {
    auto models = nlohmann::json::array();
    for (const auto& model : response.models()) models.push_back(toJson(model));
    printJson({{"models", models}});
  }

  static void printTable(const v1::ListModelsResponse& response) {
    std::cout << std::left << std::setw(32) << "MODEL" << std::setw(11) << "KIND" << std::right << std::setw(9)
              << "VERTICES" << std::setw(8) << "SHAPES" << std::setw(7) << "MODES"
              << "  " << std::left << std::setw(21) << "CREATED"
              << "  STATE\n";
    for (const auto& model : response.models()) {
      const auto size = sizeOf(model);
      std::cout << std::left << std::setw(32) << modelText(model.model()) << std::setw(11) << model.kind() << std::right
                << std::setw(9) << model.vertex_count() << std::setw(8) << size.training_shapes << std::setw(7)
                << size.modes << "  " << timeText(model.created()) << "  " << stateText(model) << "\n";
    }
  }
};

}  // namespace

Verb modelsVerb() { return makeVerb<Models>("models", "List the models that the daemon serves"); }

}  // namespace shaped::shapectl
