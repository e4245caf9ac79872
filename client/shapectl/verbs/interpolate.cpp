#include <filesystem>
#include <iomanip>
#include <sstream>

#include "client/mesh.h"
#include "client/shapectl/answer.h"
#include "client/shapectl/numbers.h"
#include "client/shapectl/progress_bar.h"
#include "client/shapectl/verbs/verbs.h"
#include "shaped/v1/shapes.grpc.pb.h"

namespace shaped::shapectl {
namespace {

using Summary = v1::InterpolateResponse::Summary;
using Frame = v1::InterpolateResponse::Frame;

/// A frame without its positions, for the report.
nlohmann::json toJson(const Frame& frame, const std::string& file) {
  nlohmann::json document{{"time", frame.time()}, {"smallest_area_ratio", frame.smallest_area_ratio()}};
  addReport(document, frame.report());
  if (!file.empty()) document["file"] = file;
  return document;
}

struct Interpolate {
  std::string a, b, out;
  std::int64_t path_steps = 0, frames = 0;
  double from = 0, to = 1, bending = 0;

  void declare(Arguments& arguments) {
    arguments.positional("A", a, "The first mesh");
    arguments.positional("B", b, "The last mesh, of the same connectivity");
    arguments.option("--path-steps", path_steps, "K", "Steps of the discrete geodesic (4)");
    arguments.option("--frames", frames, "N", "Shapes to make, evenly spaced (K + 1 when there is -o)");
    arguments.option("--from", from, "T0", "Where the frames begin: 0 is A, 1 is B (0)");
    arguments.option("--to", to, "T1", "Where they end; outside [0, 1] extrapolates (1)");
    arguments.option("--bending", bending, "ETA", "Bending weight [m^2] (2.5e-5 times the squared diameter)");
    arguments.option("-o,--out", out, "OUTDIR", "Write the frames there as PLY");
  }

  ExitCode run(const Session& session) const {
    const auto first = readMesh(a), last = readMesh(b);
    client::requireConnectivity(b, last, first.vertices.rows(), first.faces, a);
    const auto request = requestFor(first, last);
    if (!out.empty()) std::filesystem::create_directories(out);
    client::Call call(session.callOptions());
    const auto stub = v1::Shapes::NewStub(session.channel());
    const auto stream = stub->Interpolate(call.context(), request);
    Summary summary;
    auto report = nlohmann::json::array();
    bool converged = true;
    {
      ProgressBar bar;
      for (v1::InterpolateResponse response; stream->Read(&response);) {
        if (response.has_summary()) summary = response.summary();
        if (!response.has_frame()) continue;
        report.push_back(toJson(response.frame(), write(response.frame(), first.faces)));
        converged = converged && response.frame().report().termination() == v1::TERMINATION_CONVERGED;
        bar.show(static_cast<double>(report.size()) / request.times_size(), "frames");
      }
    }
    client::require(stream->Finish());
    print(summary, report, session);
    return converged ? exitCodeOf(summary.report()) : ExitCode::kNotConverged;
  }

 private:
  v1::InterpolateRequest requestFor(const MeshFile& first, const MeshFile& last) const {
    v1::InterpolateRequest request;
    *request.mutable_from() = client::pack(first);
    client::pack(last.vertices, *request.mutable_to()->mutable_positions());
    request.set_path_steps(countOf("--path-steps", path_steps));
    request.set_bending(bending);
    constexpr int default_steps = 4;
    const std::int64_t nodes = (path_steps > 0 ? path_steps : default_steps) + 1;
    const auto count = countOf("--frames", frames == 0 && !out.empty() ? nodes : frames);
    constexpr std::uint32_t most = 10000;  // of the daemon
    if (count > most) throw InvalidInput("--frames", "= " + std::to_string(count) + ", want at most 10000");
    for (std::uint32_t i = 0; i < count; ++i)
      request.add_times(count == 1 ? from : from + (to - from) * i / (count - 1));
    return request;
  }

  /// The file's name; empty when nothing is to be written.
  std::string write(const Frame& frame, const Faces& faces) const {
    if (out.empty()) return "";
    std::ostringstream name;
    name << "frame_" << std::setw(4) << std::setfill('0') << frame.index() << ".ply";
    const auto path = std::filesystem::path(out) / name.str();
    writeMesh(path, client::unpack(frame.shape().positions()), faces);
    return path.string();
  }

  static void print(const Summary& summary, const nlohmann::json& frames, const Session& session) {
    if (session.json) {
      nlohmann::json document{{"path_energy", summary.path_energy()},
                              {"segment_energies", summary.segment_energies()},
                              {"bending", summary.bending()},
                              {"smallest_area_ratio", summary.smallest_area_ratio()},
                              {"model", nullptr},
                              {"frames", frames}};
      addReport(document, summary.report());
      return printJson(document);
    }
    std::cout << reportText(summary.report()) << ", smallest area ratio " << summary.smallest_area_ratio()
              << "\npath energy " << summary.path_energy() << " m^2, segments";
    for (const double energy : summary.segment_energies()) std::cout << " " << energy;
    std::cout << "\n";
    for (const auto& frame : frames)
      std::cout << "  t = " << frame["time"] << ": " << frame["termination"].get<std::string>() << " "
                << frame.value("file", "") << "\n";
  }
};

}  // namespace

Verb interpolateVerb() { return makeVerb<Interpolate>("interpolate", "Make shapes along the geodesic of two meshes"); }

}  // namespace shaped::shapectl
