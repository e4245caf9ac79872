#include "core/model/shell_pga_file.h"

#include <limits>

#include "core/io/file_error.h"
#include "core/io/json_fields.h"
#include "core/model/sparse_tensors.h"

namespace shaped {
namespace {

constexpr int kFormatVersion = 1;
constexpr int kMostCount = 1'000'000'000;  ///< of anything that a description counts
constexpr int kMostPathSteps = 1'000'000;
constexpr const char *kSymmetricName = "symmetric", *kDirectedName = "directed";

nlohmann::json toJson(const Outcome& outcome) {
  return {
      {"termination", name(outcome.termination)}, {"iterations", outcome.iterations}, {"residual", outcome.residual}};
}

int countIn(const nlohmann::json& description, const char* field, int least) {
  return static_cast<int>(requireWholeNumber(description, field, least, kMostCount));
}

Outcome outcomeFrom(const nlohmann::json& json) {
  Outcome outcome;
  const auto text = json.at("termination").get<std::string>();
  for (const auto kind : {Termination::kConverged, Termination::kIterationLimit, Termination::kStalled,
                          Termination::kCancelled, Termination::kNumericalFailure})
    if (name(kind) == text) outcome.termination = kind;
  outcome.iterations = countIn(json, "iterations", 0);
  // JSON has no infinities: a residual that is not finite is written as null
  const auto& residual = json.at("residual");
  outcome.residual = residual.is_null() ? std::numeric_limits<double>::infinity() : residual.get<double>();
  return outcome;
}

/// Models from before there was a choice are directed.
EnergySymmetry symmetryFrom(const nlohmann::json& description) {
  const auto text = description.value("path_energy", kDirectedName);
  if (text == kSymmetricName) return EnergySymmetry::kSymmetric;
  if (text == kDirectedName) return EnergySymmetry::kDirected;
  throw InvalidInput("path_energy", "is \"" + text + "\", want " + kSymmetricName + " or " + kDirectedName);
}

/// Some rows at a time: those of a large matrix lie so far apart that a column of all would take a cache line a number.
Eigen::MatrixXd columnMajor(const Eigen::Map<const RowMajorMatrix<double>>& rows) {
  constexpr Eigen::Index kRows = 64;
  Eigen::MatrixXd matrix(rows.rows(), rows.cols());
  for (Eigen::Index begin = 0; begin < rows.rows(); begin += kRows) {
    const auto count = std::min(kRows, rows.rows() - begin);
    matrix.middleRows(begin, count) = rows.middleRows(begin, count);
  }
  return matrix;
}

/// `count` shapes below each other, as they lie in the file.
ShapeStack shapesIn(const std::shared_ptr<const TensorFile>& file, const char* name, Eigen::Index count,
                    Eigen::Index vertices) {
  file->requireShape(name, {count * vertices, 3});
  return {file, file->values<double>(name).data(), static_cast<std::size_t>(count), vertices, file->bytes().size()};
}

ShellPga pgaFrom(const std::shared_ptr<const TensorFile>& file, int path_steps, Eigen::Index coarse_vertices) {
  const auto& tensors = *file;
  ShellPga pga;
  pga.mean = tensors.matrix<double>("mean", coarse_vertices, 3);
  const auto values = tensors.values<double>("eigenvalues");
  pga.eigenvalues = Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
  // Before the eigenvectors: without eigenvalues they could have any number of columns in no bytes.
  if (pga.eigenvalues.size() < 1 || !pga.eigenvalues.allFinite())
    throw InvalidInput("eigenvalues", "are none or not finite");
  pga.eigenvectors = columnMajor(tensors.matrix<double>("eigenvectors", pga.eigenvalues.size(), -1));
  const auto modes = pga.eigenvectors.cols();
  if (modes < 1 || modes > pga.eigenvalues.size() || !pga.eigenvectors.allFinite())
    throw InvalidInput("eigenvectors", "are none, more than the eigenvalues or not finite");
  pga.path_steps = path_steps;
  pga.variations = shapesIn(file, "variations", 2 * modes, coarse_vertices);
  return pga;
}

double bendingFrom(const nlohmann::json& description) {
  const double bending = description.at("bending").get<double>();
  if (!(bending > 0)) throw InvalidInput("bending", "must be positive");
  return bending;
}

/// What solvers take for granted of the shapes on the coarse mesh.
void requireCoarseShapes(const Topology& coarse, const ShellPga& pga) {
  requireOneComponent(coarse, "coarse.faces");
  requireValidShape(coarse, pga.mean, "mean");
  requireValidShapes(coarse, pga.variations, "variations");
}

ShellPgaParts partsFrom(const nlohmann::json& description, const std::shared_ptr<const TensorFile>& file) {
  const auto& tensors = *file;
  ShellPgaParts parts;
  parts.template_shape = tensors.matrix<double>("template", -1, 3);
  const auto vertex_count = parts.template_shape.rows();
  parts.topology = std::make_shared<Topology>(static_cast<std::int32_t>(vertex_count),
                                              Faces(tensors.matrix<std::int32_t>("faces", -1, 3)));
  requireValidShape(*parts.topology, parts.template_shape, "template");
  parts.reference = tensors.matrix<double>("reference", vertex_count, 3);
  const auto kept = tensors.values<std::int32_t>("coarse.kept");
  parts.coarsening.kept.assign(kept.begin(), kept.end());
  parts.coarsening.coarse = std::make_shared<Topology>(static_cast<std::int32_t>(kept.size()),
                                                       Faces(tensors.matrix<std::int32_t>("coarse.faces", -1, 3)));
  for (const auto vertex : kept)
    if (vertex < 0 || vertex >= vertex_count) throw InvalidInput("coarse.kept", "names a vertex out of range");
  const auto coarse_vertices = static_cast<Eigen::Index>(kept.size());
  parts.detail = sparseFrom(tensors, "detail", vertex_count, 2 * coarse_vertices);
  parts.bending = bendingFrom(description);
  parts.symmetry = symmetryFrom(description);
  const auto path_steps = requireWholeNumber(description, "path_steps", 1, kMostPathSteps);
  parts.pga = pgaFrom(file, static_cast<int>(path_steps), coarse_vertices);
  requireCoarseShapes(*parts.coarsening.coarse, parts.pga);
  parts.training.shapes = countIn(description, "training_shapes", 0);
  parts.training.mean = outcomeFrom(description.at("training").at("mean"));
  parts.training.variations = outcomeFrom(description.at("training").at("variations"));
  parts.training.seconds = description.at("training").at("seconds").get<double>();
  return parts;
}

}  // namespace

std::int64_t publishShellPga(const ModelDirectory& directory, const std::string& name, const ShellPgaModel& model,
                             const nlohmann::json& provenance) {
  const auto& parts = model.parts();
  TensorWriter tensors;
  tensors.addMatrix("faces", parts.topology->faces());
  tensors.addMatrix("template", parts.template_shape);
  tensors.addMatrix("reference", parts.reference);
  tensors.add("coarse.kept", {static_cast<std::int64_t>(parts.coarsening.kept.size())},
              std::span<const std::int32_t>(parts.coarsening.kept));
  tensors.addMatrix("coarse.faces", parts.coarsening.coarse->faces());
  addSparse(tensors, "detail", parts.detail);
  tensors.addMatrix("mean", parts.pga.mean);
  tensors.add(
      "eigenvalues", {parts.pga.eigenvalues.size()},
      std::span<const double>(parts.pga.eigenvalues.data(), static_cast<std::size_t>(parts.pga.eigenvalues.size())));
  tensors.addMatrix("eigenvectors", parts.pga.eigenvectors);
  const auto variations = parts.pga.variations.stacked();
  tensors.add("variations", {variations.rows(), 3},
              std::span<const double>(variations.data(), static_cast<std::size_t>(variations.size())));

  ModelManifest manifest;
  manifest.kind = kShellPgaKind;
  manifest.format_version = kFormatVersion;
  manifest.created_by = "shaped " SHAPED_VERSION;
  manifest.description = {
      {"vertices", parts.topology->vertexCount()},
      {"faces", parts.topology->faces().rows()},
      {"topology", parts.topology->id()},
      {"coarse_vertices", parts.coarsening.coarse->vertexCount()},
      {"modes", model.modes()},
      {"path_steps", parts.pga.path_steps},
      {"bending", parts.bending},
      {"path_energy", parts.symmetry == EnergySymmetry::kSymmetric ? kSymmetricName : kDirectedName},
      {"training_shapes", parts.training.shapes},
      {"training",
       {{"mean", toJson(parts.training.mean)},
        {"variations", toJson(parts.training.variations)},
        {"seconds", parts.training.seconds}}},
      {"provenance", provenance}};
  return directory.publish(name, std::move(manifest), tensors);
}

void requireShellPga(const ModelManifest& manifest) {
  if (manifest.kind != kShellPgaKind)
    throw InvalidInput("manifest", "is of kind \"" + manifest.kind + "\", want \"" + kShellPgaKind + "\"");
  if (manifest.format_version != kFormatVersion)
    throw InvalidInput("manifest", "has format version " + std::to_string(manifest.format_version) + ", want " +
                                       std::to_string(kFormatVersion) +
                                       "; train it again or use the daemon that wrote it");
}

ShellPgaModelPtr shellPgaFrom(const ModelManifest& manifest, const std::shared_ptr<const TensorFile>& tensors) try {
  requireShellPga(manifest);
  auto model = std::make_shared<const ShellPgaModel>(partsFrom(manifest.description, tensors));
  if (!model->mean().allFinite()) throw InvalidInput("mean", "cannot be carried to full resolution");
  return model;
} catch (const nlohmann::json::exception& problem) {
  throw InvalidInput("manifest", std::string("has a faulty description: ") + problem.what());
}

ShellPgaModelPtr loadShellPga(const StoredModel& stored) try {
  return shellPgaFrom(stored.manifest, stored.tensors);
} catch (const InvalidInput& problem) {
  throw FileError("model " + stored.name + " version " + std::to_string(stored.version),
                  std::string("cannot be used: ") + problem.what());
}

}  // namespace shaped
