#include "client/mesh.h"
#include "client/models.h"
#include "client/shapectl/answer.h"
#include "client/shapectl/coefficients.h"
#include "client/shapectl/verbs/verbs.h"
#include "shaped/v1/shapes.grpc.pb.h"

namespace shaped::shapectl {
namespace {

struct Synthesize {
  std::string name, coefficients, out;
  bool fine = false;

  void declare(Arguments& arguments) {
    arguments.positional("NAME", name, "The model, NAME or NAME@VERSION");
    arguments.option("--coefficients", coefficients, "C.json", "The coefficients, as `project` writes them");
    arguments.required();
    arguments.option("-o,--out", out, "OUT.ply", "Write the shape");
    arguments.required();
    arguments.flag("--fine", fine, "Finish by Newton's method at full resolution");
  }

  ExitCode run(const Session& session) const {
    v1::SynthesizeRequest request;
    *request.mutable_coefficients() = readCoefficients(coefficients);
    request.set_fine(fine);
    const auto channel = session.channel();
    const auto model = client::getModelMesh(channel, parseModel(name), session.callOptions());
    *request.mutable_model() = client::pinned(model.description);
    client::Call call(session.callOptions());
    v1::SynthesizeResponse response;
    client::require(v1::Shapes::NewStub(channel)->Synthesize(call.context(), request, &response));
    writeMesh(out, client::unpack(response.shape().positions()), model.faces);
    if (session.json)
      printJson(documentOf(response));
    else
      std::cout << answerText(response) << "\n";
    return exitCodeOf(response.report());
  }
};

}  // namespace

Verb synthesizeVerb() { return makeVerb<Synthesize>("synthesize", "Make the shape of given coefficients"); }

}  // namespace shaped::shapectl
