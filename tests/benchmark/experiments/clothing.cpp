#include "core/clothing/under_clothing.h"

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "core/io/file.h"
#include "core/io/mesh_file.h"
#include "core/io/scan_file.h"
#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/surface/closest_point.h"
#include "tests/benchmark/experiments/body_data.h"
#include "tests/benchmark/experiments/experiment.h"
#include "tests/benchmark/experiments/timing.h"

namespace shaped::experiments {
namespace {

struct ClothedData {
  std::vector<Scan> scans;
  std::vector<Vertices> bodies;   ///< under the cloth, in the scan's place
  std::vector<double> thickness;  ///< of the cloth over trunk and legs, median, m
  Vertices rest;
};

ClothedData clothedData() {
  const auto truth = nlohmann::json::parse(readFile(dataPath("body_scans/scans.json")));
  ClothedData data;
  for (const auto& entry : truth.at("clothed")) {
    RigidMotion motion;
    for (int r = 0; r < 3; ++r) {
      motion.translation[r] = entry.at("t").at(std::size_t(r));
      for (int c = 0; c < 3; ++c) motion.rotation(r, c) = entry.at("R").at(std::size_t(r)).at(std::size_t(c));
    }
    data.scans.push_back(readScan(dataPath("body_scans/" + entry.at("scan").get<std::string>())));
    data.bodies.push_back(
        apply(motion, readMesh(dataPath("body_scans/" + entry.at("gt").get<std::string>())).vertices));
    data.thickness.push_back(entry.at("offset_m").at("trunk_legs_median"));
  }
  data.rest = readMesh(dataPath("body_scans/clothed/rest_gt.ply")).vertices;
  return data;
}

}  // namespace

void clothing() {
  Report report("Body under clothing: 8 frames of a walk, cloth of 1 to 6 cm");
  const OneThread one_thread;
  const auto data = bodyData();
  std::vector<Vertices> training;
  for (const std::size_t i : data.others) training.push_back(data.rest[i]);
  BodyTrainingOptions options;
  options.posture = PostureNormalisation::kNone;
  options.modes = 40;
  const BodyModel model = trainBody(data.reference, training, options)->model;
  const auto clothed = clothedData();
  const Stopwatch watch;
  const auto result = estimateUnderClothing(clothed.scans, model, {});
  const double seconds = watch.cpu();
  for (std::size_t f = 0; f < clothed.scans.size(); ++f) {
    const auto& frame = result.solution.frames[f];
    const double error =
        meanVertexDistance(model.posed({result.solution.identity, frame.pose}).vertices(), clothed.bodies[f]);
    report.entry(text("frame %zu: v2v; cloth, median; %s", f, name(frame.outcome.termination).data()),
                 text("%.1f mm; %.1f mm", 1000 * error, 1000 * clothed.thickness[f]), "v2v < half the cloth",
                 error < 0.5 * clothed.thickness[f]);
    report.entry(
        text("frame %zu (%s): inside or within 3 mm; strictly; mean gap", f, frame.trusted ? "trusted" : "doubtful"),
        text("%.1f %%; %.1f %%; %.1f mm", 100 * frame.inside, 100 * frame.inside_strictly, 1000 * frame.mean_gap),
        "98 % inside", frame.inside >= 0.98);
    if (const char* folder = std::getenv("CLOTHING_MESHES"))
      writeMesh(std::filesystem::path(folder) / text("body_%zu.ply", f),
                model.posed({result.solution.identity, frame.pose}).vertices(), model.topology()->faces());
  }
  const Vertices rest = model.rest(result.solution.identity);
  report.entry("identity at rest: v2v",
               text("%.1f mm", 1000 * meanVertexDistance(apply(alignRigidly(rest, clothed.rest), rest), clothed.rest)));
  report.entry("the end; CPU s", text("%s, %.1f", name(result.termination).data(), seconds));
}

}  // namespace shaped::experiments
