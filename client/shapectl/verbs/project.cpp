#include "client/mesh.h"
#include "client/models.h"
#include "client/shapectl/answer.h"
#include "client/shapectl/coefficients.h"
#include "client/shapectl/numbers.h"
#include "client/shapectl/verbs/verbs.h"
#include "shaped/v1/shapes.grpc.pb.h"

namespace shaped::shapectl {
namespace {

struct Project {
  std::string name, mesh, out, coefficients;
  std::int64_t modes = 0;
  bool fine = false;

  void declare(Arguments& arguments) {
    arguments.positional("NAME", name, "The model, NAME or NAME@VERSION");
    arguments.positional("MESH", mesh, "A mesh of the model's connectivity");
    arguments.option("-o,--out", out, "OUT.ply", "Write the model's nearest shape");
    arguments.option("--coefficients", coefficients, "C.json", "Write its coefficients");
    arguments.option("--modes", modes, "J", "Principal variations to use (all)");
    arguments.flag("--fine", fine, "Finish by Newton's method at full resolution");
  }

  ExitCode run(const Session& session) const {
    const auto channel = session.channel();
    const auto model = client::getModelMesh(channel, parseModel(name), session.callOptions());
    v1::ProjectRequest request;
    *request.mutable_model() = client::pinned(model.description);
    *request.mutable_shape() = client::readShape(mesh, model.mean.rows(), model.faces);
    request.set_modes(countOf("--modes", modes));
    request.set_fine(fine);
    client::Call call(session.callOptions());
    v1::ProjectResponse response;
    client::require(v1::Shapes::NewStub(channel)->Project(call.context(), request, &response));
    if (!out.empty()) writeMesh(out, client::unpack(response.shape().positions()), model.faces);
    if (!coefficients.empty()) writeCoefficients(coefficients, response.coefficients());
    print(response, session);
    return exitCodeOf(response.report());
  }

 private:
  static void print(const v1::ProjectResponse& response, const Session& session) {
    if (session.json) {
      auto document = documentOf(response);
      document["coefficients"] = toJson(response.coefficients());
      document["tangent_coordinates"] = response.tangent_coordinates();
      document["residual_energy"] = response.residual_energy();
      document["score"] = toJson(response.score());
      return printJson(document);
    }
    std::cout << answerText(response) << "\nresidual energy " << response.residual_energy()
              << " m^2, Mahalanobis distance " << response.score().mahalanobis() << "\n";
  }
};

}  // namespace

Verb projectVerb() { return makeVerb<Project>("project", "Find the model's shape nearest to a mesh"); }

}  // namespace shaped::shapectl
