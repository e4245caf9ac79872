#include "client/mesh.h"
#include "client/models.h"
#include "client/shapectl/answer.h"
#include "client/shapectl/coefficients.h"
#include "client/shapectl/verbs/verbs.h"
#include "shaped/v1/shapes.grpc.pb.h"

namespace shaped::shapectl {
namespace {

struct Score {
  std::string name, mesh;

  void declare(Arguments& arguments) {
    arguments.positional("NAME", name, "The model, NAME or NAME@VERSION");
    arguments.positional("MESH", mesh, "A mesh of the model's connectivity");
  }

  ExitCode run(const Session& session) const {
    const auto channel = session.channel();
    const auto model = client::getModelMesh(channel, parseModel(name), session.callOptions());
    v1::ScoreRequest request;
    *request.mutable_model() = client::pinned(model.description);
    *request.mutable_shape() = client::readShape(mesh, model.mean.rows(), model.faces);
    client::Call call(session.callOptions());
    v1::ScoreResponse response;
    client::require(v1::Shapes::NewStub(channel)->Score(call.context(), request, &response));
    if (session.json) {
      auto document = documentOf(response);
      document.update(toJson(response.score()));
      printJson(document);
    } else {
      std::cout << answerText(response) << "\nMahalanobis distance " << response.score().mahalanobis()
                << ", log-likelihood " << response.score().log_likelihood() << ", unexplained "
                << response.score().residual_distance() << " m\n";
    }
    return exitCodeOf(response.report());
  }
};

}  // namespace

Verb scoreVerb() { return makeVerb<Score>("score", "Say how probable a mesh is under a model"); }

}  // namespace shaped::shapectl
