#include "core/model/shell_pga_checkpoint.h"

#include <algorithm>

#include "core/io/sealed_tensors.h"
#include "core/model/state_tensors.h"

namespace shaped {
namespace {

constexpr const char *kFormat = "shell_pga_checkpoint 2", *kTrainingKey = "training";

template <class Item>
std::size_t countOf(const std::vector<std::optional<Item>>& items) {
  return static_cast<std::size_t>(
      std::count_if(items.begin(), items.end(), [](const auto& item) { return item.has_value(); }));
}

template <class Item>
std::string doneText(const std::vector<std::optional<Item>>& items) {
  return std::to_string(countOf(items)) + " of " + std::to_string(items.size());
}

using Shapes = std::vector<std::optional<Solved<Vertices>>>;

/// Which shapes there are and how their solvers ended, k x 4; then the shapes below each other.
void addShapes(const std::string& name, const Shapes& shapes, TensorWriter& file) {
  Eigen::MatrixXd states = Eigen::MatrixXd::Zero(std::ssize(shapes), 4);
  std::vector<Vertices> there;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    if (!shapes[i]) continue;
    states(static_cast<Eigen::Index>(i), 0) = 1;
    states.row(static_cast<Eigen::Index>(i)).tail(3) = numbersOf(*shapes[i]);
    there.push_back(shapes[i]->solution);
  }
  file.addMatrix(name + ".states", states);
  file.addMatrix(name, stack(there));
}

Shapes readShapes(const TensorFile& file, const std::string& name, Eigen::Index vertices) {
  const Eigen::MatrixXd states = file.matrix<double>(name + ".states", -1, 4);
  auto there = unstack(file.matrix<double>(name, -1, 3), vertices);
  Shapes shapes(static_cast<std::size_t>(states.rows()));
  std::size_t next = 0;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const auto row = states.row(static_cast<Eigen::Index>(i));
    if (row[0] != 0) shapes[i] = Solved<Vertices>(std::move(there[next++]), outcomeOf(row.tail(3)));
  }
  return shapes;
}

/// Which rows there are, k x 1; then these rows.
void addRows(const std::string& name, const std::vector<std::optional<Eigen::VectorXd>>& rows, TensorWriter& file) {
  Eigen::VectorXd states = Eigen::VectorXd::Zero(std::ssize(rows));
  Eigen::MatrixXd there(static_cast<Eigen::Index>(countOf(rows)), std::ssize(rows));
  Eigen::Index next = 0;
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (rows[i]) states[static_cast<Eigen::Index>(i)] = 1, there.row(next++) = *rows[i];
  file.addMatrix(name + ".states", states);
  file.addMatrix(name, there);
}

std::vector<std::optional<Eigen::VectorXd>> readRows(const TensorFile& file, const std::string& name) {
  const Eigen::VectorXd states = file.matrix<double>(name + ".states", -1, 1);
  const auto there = file.matrix<double>(name);
  std::vector<std::optional<Eigen::VectorXd>> rows(static_cast<std::size_t>(states.size()));
  Eigen::Index next = 0;
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (states[static_cast<Eigen::Index>(i)] != 0) rows[i] = there.row(next++);
  return rows;
}

}  // namespace

std::string stageOf(const VariationsProgress& done) {
  if (countOf(done.forward) > 0) return "principal variations, " + doneText(done.forward);
  if (countOf(done.reflected) > 0) return "reflections, " + doneText(done.reflected);
  return countOf(done.gram_rows) > 0 ? "Gram matrix, " + doneText(done.gram_rows) + " rows" : "";
}

double shareOf(const VariationsProgress& done) {
  const auto items = done.gram_rows.size() + done.reflected.size() + done.forward.size();
  const auto there = countOf(done.gram_rows) + countOf(done.reflected) + countOf(done.forward);
  return items == 0 ? 0 : static_cast<double>(there) / static_cast<double>(items);
}

std::string ShellPgaCheckpoint::stage() const {
  if (!spider) return "coarsening done";
  if (!mean_ended) return "Frechet mean, Newton step " + std::to_string(mean.iterations);
  const auto variations_stage = stageOf(variations);
  return variations_stage.empty() ? "Frechet mean done" : variations_stage;
}

void writeCheckpoint(const std::filesystem::path& path, const ShellPgaCheckpoint& checkpoint) {
  TensorWriter file;
  file.setMetadata(kTrainingKey, checkpoint.training);
  const auto& kept = checkpoint.coarsening.kept;
  file.add("coarse.kept", {std::ssize(kept), 1}, std::span<const std::int32_t>(kept));
  file.addMatrix("coarse.faces", checkpoint.coarsening.coarse->faces());
  addSpider("spider", checkpoint.spider, file);
  file.addMatrix("mean.outcome", numbersOf(checkpoint.mean));
  file.addMatrix("mean.ended", Eigen::Matrix<std::int64_t, 1, 1>(std::int64_t{checkpoint.mean_ended}));
  addRows("gram", checkpoint.variations.gram_rows, file);
  addShapes("reflected", checkpoint.variations.reflected, file);
  addShapes("forward", checkpoint.variations.forward, file);
  addShapes("backward", checkpoint.variations.backward, file);
  writeSealed(path, file, kFormat);
}

ShellPgaCheckpoint readCheckpoint(const std::filesystem::path& path) {
  const TensorFile file(path);
  requireSealed(file, path, kFormat);
  ShellPgaCheckpoint checkpoint;
  checkpoint.training = metadataOf(file, path, kTrainingKey);
  const auto kept = file.values<std::int32_t>("coarse.kept");
  checkpoint.coarsening.kept.assign(kept.begin(), kept.end());
  const auto vertices = std::ssize(kept);
  checkpoint.coarsening.coarse = std::make_shared<const Topology>(
      static_cast<std::int32_t>(vertices), Faces(file.matrix<std::int32_t>("coarse.faces", -1, 3)));
  checkpoint.spider = readSpider(file, "spider");
  checkpoint.mean = outcomeOf(file.matrix<double>("mean.outcome", 1, 3));
  checkpoint.mean_ended = file.values<std::int64_t>("mean.ended")[0] != 0;
  checkpoint.variations = {readRows(file, "gram"), readShapes(file, "reflected", vertices),
                           readShapes(file, "forward", vertices), readShapes(file, "backward", vertices)};
  return checkpoint;
}

}  // namespace shaped
