#include "core/clothing/under_clothing.h"

#include <cstdlib>
#include <filesystem>

#include "core/io/mesh_file.h"
#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "tests/benchmark/experiments/clothed_data.h"
#include "tests/benchmark/experiments/experiment.h"
#include "tests/benchmark/experiments/timing.h"

namespace shaped::experiments {
namespace {

/// A model of the 80 bodies that no scan shows.
BodyModel clothingModel(const BodyData& data) {
  std::vector<Vertices> training;
  for (const std::size_t i : data.others) training.push_back(data.rest[i]);
  BodyTrainingOptions options;
  options.posture = PostureNormalisation::kNone;
  options.modes = 40;
  return trainBody(data.reference, training, options)->model;
}

void tellFrame(Report& report, const BodyModel& model, const ClothedBody& found, const ClothedData& clothed,
               std::size_t f) {
  const auto& frame = found.frames[f];
  const double error = meanVertexDistance(model.posed({found.identity, frame.pose}).vertices(), clothed.bodies[f]);
  report.entry(text("frame %zu: v2v; cloth, median; %s", f, name(frame.outcome.termination).data()),
               text("%.1f mm; %.1f mm", 1000 * error, 1000 * clothed.thickness[f]), "v2v < half the cloth",
               error < 0.5 * clothed.thickness[f]);
  report.entry(
      text("frame %zu (%s): inside or within 3 mm; strictly; mean gap", f, frame.trusted ? "trusted" : "doubtful"),
      text("%.1f %%; %.1f %%; %.1f mm", 100 * frame.inside, 100 * frame.inside_strictly, 1000 * frame.mean_gap),
      "98 % inside", frame.inside >= 0.98);
}

/// Bodies of a sequence into the folder that CLOTHING_MESHES names.
void writeBodies(const std::string& sequence, const BodyModel& model, const ClothedBody& found) {
  const char* folder = std::getenv("CLOTHING_MESHES");
  if (!folder) return;
  for (std::size_t f = 0; f < found.frames.size(); ++f)
    writeMesh(std::filesystem::path(folder) / text("%s_%zu.ply", sequence.c_str(), f),
              model.posed({found.identity, found.frames[f].pose}).vertices(), model.topology()->faces());
}

/// One section of the report; SHAPED_CLOTHED names the only sequence that is wanted, "walk" or "run".
void clothedSequence(const std::string& sequence, const BodyModel& model, const ClothedData& clothed) {
  Report report("Body under clothing: " + std::to_string(clothed.scans.size()) + " frames of a " + sequence +
                ", cloth of 1 to 6 cm");
  const Stopwatch watch;
  const auto result = estimateUnderClothing(clothed.scans, model, {});
  const double seconds = watch.cpu();
  for (std::size_t f = 0; f < clothed.scans.size(); ++f) tellFrame(report, model, result.solution, clothed, f);
  writeBodies(sequence, model, result.solution);
  const Vertices rest = model.rest(result.solution.identity);
  report.entry("identity at rest: v2v",
               text("%.1f mm", 1000 * meanVertexDistance(apply(alignRigidly(rest, clothed.rest), rest), clothed.rest)));
  report.entry("the end; CPU s", text("%s, %.1f", name(result.termination).data(), seconds));
}

}  // namespace

void clothing() {
  const OneThread one_thread;
  const auto data = bodyData();
  const BodyModel model = clothingModel(data);
  const char* only = std::getenv("SHAPED_CLOTHED");
  const auto wanted = [&](const std::string& sequence) { return !only || sequence == only; };
  if (wanted("walk")) clothedSequence("walk", model, clothedWalk());
  if (wanted("run")) clothedSequence("run", model, clothedRun(data));
}

}  // namespace shaped::experiments
