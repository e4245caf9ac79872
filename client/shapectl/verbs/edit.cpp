#include "client/mesh.h"
#include "client/models.h"
#include "client/shapectl/answer.h"
#include "client/shapectl/coefficients.h"
#include "client/shapectl/numbers.h"
#include "client/shapectl/verbs/verbs.h"
#include "core/io/handle_file.h"
#include "shaped/v1/shapes.grpc.pb.h"

namespace shaped::shapectl {
namespace {

struct Edit {
  std::string name, handles, out;
  std::int64_t modes = 0, outer_iterations = 0;

  void declare(Arguments& arguments) {
    arguments.positional("NAME", name, "The model, NAME or NAME@VERSION");
    arguments.option("--handles", handles, "H.csv", "Lines vertex,x,y,z: which vertex goes where, in metres");
    arguments.required();
    arguments.option("-o,--out", out, "OUT.ply", "Write the shape that meets the handles");
    arguments.required();
    arguments.option("--modes", modes, "J", "Principal variations to use (all)");
    arguments.option("--outer-iterations", outer_iterations, "N", "Alternations at most (40)");
  }

  ExitCode run(const Session& session) const {
    v1::EditRequest request;
    for (const auto& [vertex, position] : readHandles(handles)) {
      auto& handle = *request.add_handles();
      handle.set_vertex(static_cast<std::uint32_t>(vertex));
      handle.set_x(position.x());
      handle.set_y(position.y());
      handle.set_z(position.z());
    }
    request.set_modes(countOf("--modes", modes));
    request.set_outer_iterations(countOf("--outer-iterations", outer_iterations));
    const auto channel = session.channel();
    const auto model = client::getModelMesh(channel, parseModel(name), session.callOptions());
    *request.mutable_model() = client::pinned(model.description);
    client::Call call(session.callOptions());
    v1::EditResponse response;
    client::require(v1::Shapes::NewStub(channel)->Edit(call.context(), request, &response));
    writeMesh(out, client::unpack(response.shape().positions()), model.faces);
    print(response, session);
    return exitCodeOf(response.report());
  }

 private:
  static void print(const v1::EditResponse& response, const Session& session) {
    if (session.json) {
      auto document = documentOf(response);
      document["energies"] = response.energies();
      document["largest_handle_distance"] = response.largest_handle_distance();
      document["coefficients"] = toJson(response.coefficients());
      return printJson(document);
    }
    std::cout << answerText(response) << "\nhandles met to " << response.largest_handle_distance()
              << " m; energy over the outer iterations [m^2]:";
    for (const double energy : response.energies()) std::cout << " " << energy;
    std::cout << "\n";
  }
};

}  // namespace

Verb editVerb() { return makeVerb<Edit>("edit", "Find the most natural shape whose handles lie where told"); }

}  // namespace shaped::shapectl
