#include "server/field_training/field_job.h"

#include <nlohmann/json.hpp>

#include "core/io/file.h"
#include "core/io/folder.h"
#include "core/io/tensor_file.h"
#include "core/io/text_scanner.h"
#include "core/neural/jacobian_field_file.h"
#include "core/numerics/error.h"
#include "server/errors/errors.h"

namespace shaped::server {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char *kReference = "model", *kReferenceFile = "model.safetensors";
constexpr double kRateFalls = 0.01;

std::string pairFile(std::size_t index) { return "pair_" + std::to_string(index) + ".safetensors"; }

void writeReference(const fs::path& path, const FieldReference& reference) {
  TensorWriter file;
  file.addMatrix("faces", reference.poisson->topology().faces());
  file.addMatrix("shape", reference.shape);
  file.write(path);
}

void writePair(const fs::path& path, const RestPair& pair) {
  TensorWriter file;
  file.addMatrix("source", pair.source);
  file.addMatrix("target", pair.target);
  file.addMatrix("scan", pair.scan.points);
  if (pair.scan.normals.rows() > 0) file.addMatrix("scan_normals", pair.scan.normals);
  file.write(path);
}

json jobOf(const FieldTrainingSet& set, const FieldJobOptions& options, const FieldJobRun& run) {
  auto pairs = json::array();
  for (std::size_t i = 0; i < set.pairs.size(); ++i)
    pairs.push_back({{"reference", kReference}, {"file", pairFile(i)}});
  return {{"kind", "jacobian_field"},
          {"references", {{kReference, kReferenceFile}}},
          {"pairs", pairs},
          {"scaling", kReference},
          {"architecture", {{"offsets", options.offsets}}},
          {"options",
           {{"epochs", options.epochs},
            {"batch", options.batch},
            {"learning_rate", options.learning_rate},
            {"last_learning_rate", kRateFalls * options.learning_rate},
            {"seed", options.seed}}},
          {"threads", run.threads},
          {"checkpoint_seconds", run.checkpoint_seconds}};
}

}  // namespace

std::optional<std::string> FieldJobOptions::firstViolation() const {
  if (epochs < 1) return "epochs = " + std::to_string(epochs) + ", want >= 1";
  if (batch < 1) return "batch = " + std::to_string(batch) + ", want >= 1";
  if (!(learning_rate > 0 && learning_rate <= 1))
    return "learning_rate = " + shortest(learning_rate) + ", want > 0 and <= 1";
  return std::nullopt;
}

void writeFieldJob(const fs::path& folder, const FieldTrainingSet& set, const FieldJobOptions& options,
                   const FieldJobRun& run) {
  makeFolder(folder);
  writeReference(folder / kReferenceFile, *set.reference);
  for (std::size_t i = 0; i < set.pairs.size(); ++i) writePair(folder / pairFile(i), set.pairs[i]);
  writeFile(folder / "job.json", jobOf(set, options, run).dump(1) + "\n");
}

JacobianFieldWeights readTrainedField(const fs::path& folder) try {
  return readJacobianField(TensorFile(folder / "field.safetensors"), "field");
} catch (const InvalidInput& error) {
  throw Corrupted(std::string("what shaped-trainer has left cannot be read: ") + error.what());
}

fs::path fieldCheckpoint(const fs::path& folder) { return folder / "checkpoint.safetensors"; }

}  // namespace shaped::server
