#include "client/shapectl/curve_answer.h"
#include "client/shapectl/curve_output.h"
#include "client/shapectl/numbers.h"
#include "client/shapectl/verbs/verbs.h"
#include "shaped/v1/curves.grpc.pb.h"

namespace shaped::shapectl {
namespace {

/// A mesh's faces as the connectivity of a request.
void setTopology(const MeshFile& mesh, v1::CurveTopology& topology) {
  auto& faces = *topology.mutable_faces();
  faces.set_vertex_count(static_cast<std::uint32_t>(mesh.vertices.rows()));
  client::pack(mesh.faces, *faces.mutable_faces());
}

struct Geodesic {
  std::string a, b, out;
  std::int64_t frames = 0;
  double bending = 0;
  GeodesicFlags flags;

  void declare(Arguments& arguments) {
    arguments.positional("A", a, "The first mesh");
    arguments.positional("B", b, "The last mesh, of the same connectivity");
    arguments.option("--frames", frames, "N", "Shapes to make, with both ends (64)");
    arguments.option("-o,--out", out, "OUT.npy", "The frames, N x V x 3");
    arguments.required();
    flags.declare(arguments);
    arguments.option("--bending", bending, "ETA", "Bending weight [m^2] (2.5e-5 times the squared diameter)");
  }

  ExitCode run(const Session& session) const {
    const auto first = readMesh(a), last = readMesh(b);
    client::requireConnectivity(b, last, first.vertices.rows(), first.faces, a);
    v1::GeodesicRequest request;
    setTopology(first, *request.mutable_topology());
    client::pack(first.vertices, *request.mutable_from()->mutable_positions());
    client::pack(last.vertices, *request.mutable_to()->mutable_positions());
    request.set_frames(countOf("--frames", frames));
    request.set_bending(bending);
    flags.fill(*request.mutable_options());
    client::Call call(session.callOptions());
    const auto stub = v1::Curves::NewStub(session.channel());
    const auto stream = stub->Geodesic(call.context(), request);
    const auto summary = receiveCurve(*stream, out);
    printGeodesic(summary, out, session);
    return exitCodeOf(summary.report());
  }
};

struct Bezier {
  std::vector<std::string> controls;
  std::string out;
  std::int64_t frames = 0, auxiliary = 0;
  double bending = 0;
  GeodesicFlags flags;

  void declare(Arguments& arguments) {
    arguments.option("--frames", frames, "N", "Shapes to make, with both ends (32)");
    arguments.option("--auxiliary-frames", auxiliary, "M", "Shapes of each geodesic of the construction (9)");
    arguments.option("-o,--out", out, "OUT.npy", "The frames, N x V x 3");
    arguments.required();
    flags.declare(arguments);
    arguments.option("--bending", bending, "ETA", "Bending weight [m^2] (2.5e-5 times the squared diameter)");
    arguments.positionals("P", controls, 2, "Control shapes, meshes of one connectivity; the first and last are ends");
  }

  ExitCode run(const Session& session) const {
    const auto first = readMesh(controls.front());
    v1::BezierRequest request;
    setTopology(first, *request.mutable_topology());
    for (const auto& file : controls)
      *request.add_controls() = client::readShape(file, first.vertices.rows(), first.faces);
    request.set_frames(countOf("--frames", frames));
    request.set_auxiliary_frames(countOf("--auxiliary-frames", auxiliary));
    request.set_bending(bending);
    flags.fill(*request.mutable_options());
    client::Call call(session.callOptions());
    const auto stub = v1::Curves::NewStub(session.channel());
    const auto stream = stub->Bezier(call.context(), request);
    const auto summary = receiveCurve(*stream, out);
    printGeodesic(summary, out, session);
    return exitCodeOf(summary.report());
  }
};

}  // namespace

Verb geodesicVerb() { return makeVerb<Geodesic>("geodesic", "Make the shortest way from one shape to another"); }
Verb bezierVerb() { return makeVerb<Bezier>("bezier", "Make a smooth motion that a few shapes control"); }

}  // namespace shaped::shapectl
