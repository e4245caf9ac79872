#include <iostream>

#include "client/shapectl/numbers.h"
#include "client/shapectl/output.h"
#include "client/shapectl/verbs/verbs.h"
#include "core/io/file.h"
#include "core/io/mesh_file.h"
#include "core/io/scan_file.h"
#include "core/numerics/error.h"
#include "core/sample/virtual_scanner.h"

namespace shaped::shapectl {
namespace {

constexpr double kMillimetre = 0.001;

std::vector<double> listOf(const Eigen::RowVector3d& v) { return {v[0], v[1], v[2]}; }

/// How the scan came about, for programs that compare with it.
nlohmann::json truthOf(const VirtualScan& result) {
  nlohmann::json truth{
      {"points", result.scan.points.rows()}, {"visible_fraction", result.visible_fraction},
      {"outliers", result.outliers},         {"translation", listOf(result.motion.translation.transpose())},
      {"rotation", nlohmann::json::array()}, {"holes", nlohmann::json::array()}};
  for (const auto& row : result.motion.rotation.rowwise()) truth["rotation"].push_back(listOf(row));
  for (const auto& hole : result.holes)
    truth["holes"].push_back({{"centre", listOf(hole.centre)}, {"radius", hole.radius}});
  if (result.cut) truth["cut"] = {{"normal", listOf(result.cut->normal)}, {"offset", result.cut->offset}};
  return truth;
}

/// Where on the mesh each point was seen.
void addPlaces(nlohmann::json& truth, const VirtualScan& result) {
  for (const auto& [place, camera] : result.truth) {
    truth["faces"].push_back(place.face);
    truth["barycentric"].push_back(listOf(place.barycentric));
    truth["cameras"].push_back(camera);
  }
}

struct SampleScan {
  std::string mesh_file, out, truth_file;
  VirtualScannerOptions defaults;
  std::int64_t points = defaults.points, seed = 1;
  double noise = defaults.noise / kMillimetre, outliers = defaults.outliers, missing = 0, cut = 0;
  double hole_radius = defaults.hole_radius / kMillimetre;
  bool still = false, any_rotation = false;

  void declare(Arguments& arguments) {
    arguments.positional("MESH", mesh_file, "What to scan: a closed mesh in metres, y up (OBJ, PLY, OFF, STL)");
    arguments.option("-o,--out", out, "SCAN.ply", "Where to write points and normals");
    arguments.required();
    arguments.option("--truth", truth_file, "TRUTH.json", "Also write where on the mesh each point was seen");
    arguments.option("--points", points, "N", "Points without gaps (20000)");
    arguments.option("--noise", noise, "MM", "Standard deviation along the viewing ray [mm] (1.5)");
    arguments.option("--outliers", outliers, "F", "Share of points that lie anywhere (0.005)");
    arguments.option("--missing", missing, "F", "Share of the points that holes take away (0)");
    arguments.option("--hole-radius", hole_radius, "MM", "Radius of those holes, about [mm] (80)");
    arguments.option("--cut", cut, "F", "Share of the points that a cut takes away, all of one side (0)");
    arguments.flag("--still", still, "Leave the body where it is instead of moving it at random");
    arguments.flag("--any-rotation", any_rotation, "Turn it any way, not around y and by a tilt of 20 degrees");
    arguments.option("--seed", seed, "S", "Other seeds give other points, gaps and motions (1)");
  }

  ExitCode run(const Session& session) const {
    const auto options = scannerOptions();
    const auto mesh = readMesh(mesh_file);
    const auto result = scanVirtually(mesh.vertices, mesh.faces, options);
    writeScan(out, result.scan);
    auto truth = truthOf(result);
    if (!truth_file.empty()) {
      auto whole = truth;
      addPlaces(whole, result);
      writeFile(truth_file, whole.dump() + "\n");
    }
    truth["scan"] = out;
    print(truth, session);
    return ExitCode::kSuccess;
  }

 private:
  VirtualScannerOptions scannerOptions() const {
    VirtualScannerOptions options;
    options.points = static_cast<int>(countOf("--points", points));
    options.seed = countOf("--seed", seed);
    options.noise = kMillimetre * noise;
    options.outliers = outliers;
    options.holes = missing;
    options.hole_radius = kMillimetre * hole_radius;
    options.cut = cut;
    options.any_rotation = any_rotation;
    if (still) options.motion = RigidMotion{};
    if (const auto problem = options.firstViolation()) throw InvalidInput("options", *problem);
    return options;
  }

  static void print(const nlohmann::json& truth, const Session& session) {
    if (session.json) return printJson(truth);
    std::cout << truth["scan"].get<std::string>() << ": " << truth["points"] << " points, " << truth["outliers"].size()
              << " of them outliers; the cameras see " << 100 * truth["visible_fraction"].get<double>()
              << " % of the surface\n";
    if (!truth["holes"].empty()) std::cout << "  " << truth["holes"].size() << " holes\n";
  }
};

}  // namespace

Verb sampleScanVerb() {
  return makeVerb<SampleScan>("sample-scan", "Scan a mesh as a body scanner would: noisy points of what cameras see");
}

}  // namespace shaped::shapectl
