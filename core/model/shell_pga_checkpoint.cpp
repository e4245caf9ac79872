#include "core/model/shell_pga_checkpoint.h"

#include <algorithm>
#include <array>

#include "core/io/sha256.h"
#include "core/io/tensor_file.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

constexpr const char* kFormat = "shell_pga_checkpoint 1";
constexpr const char *kFormatKey = "format", *kTrainingKey = "training", *kHashKey = "sha256";

constexpr std::array kTerminations{Termination::kConverged, Termination::kIterationLimit, Termination::kStalled,
                                   Termination::kCancelled, Termination::kNumericalFailure};

template <class Derived>
std::string_view bytesOf(const Eigen::DenseBase<Derived>& numbers) {
  return {reinterpret_cast<const char*>(numbers.derived().data()),
          static_cast<std::size_t>(numbers.size()) * sizeof(typename Derived::Scalar)};
}

/// The arms' shapes below each other without the mean, which begins each: n K C x 3.
Vertices stackArms(const Spider& spider) {
  const auto rows = spider.mean.rows();
  const auto steps = static_cast<Eigen::Index>(spider.arms.front().size()) - 1;
  Vertices stacked(static_cast<Eigen::Index>(spider.arms.size()) * steps * rows, 3);
  Eigen::Index at = 0;
  for (const auto& arm : spider.arms)
    for (Eigen::Index k = 1; k <= steps; ++k, at += rows)
      stacked.middleRows(at, rows) = arm[static_cast<std::size_t>(k)];
  return stacked;
}

std::vector<Path> splitArms(const Vertices& mean, const Vertices& stacked, std::int64_t count, std::int64_t steps) {
  std::vector<Path> arms(static_cast<std::size_t>(count), Path{mean});
  Eigen::Index at = 0;
  for (auto& arm : arms)
    for (std::int64_t k = 0; k < steps; ++k, at += mean.rows()) arm.emplace_back(stacked.middleRows(at, mean.rows()));
  return arms;
}

/// The numbers of a checkpoint as they lie in its file, and the hash that tells a damaged file.
struct Content {
  Eigen::VectorXi kept;
  Faces faces;
  Eigen::Matrix<std::int64_t, 5, 1> counts;  ///< has a spider, mean ended, termination, iterations, K
  Eigen::Matrix<double, 1, 1> residual;
  Vertices mean, arms;  ///< empty without a spider

  std::string hash(const std::string& training) const {
    Sha256 sum;
    for (const auto bytes : {std::string_view(kFormat), std::string_view(training), bytesOf(kept), bytesOf(faces),
                             bytesOf(counts), bytesOf(residual), bytesOf(mean), bytesOf(arms)})
      sum.update(bytes);
    return sum.finish();
  }
};

Content contentOf(const ShellPgaCheckpoint& checkpoint) {
  Content content;
  const auto& kept = checkpoint.coarsening.kept;
  content.kept = Eigen::Map<const Eigen::VectorXi>(kept.data(), static_cast<Eigen::Index>(kept.size()));
  content.faces = checkpoint.coarsening.coarse->faces();
  const auto& outcome = checkpoint.mean;
  const auto* termination = std::find(kTerminations.begin(), kTerminations.end(), outcome.termination);
  const bool has_spider = checkpoint.spider.has_value();
  content.counts << has_spider, checkpoint.mean_ended, termination - kTerminations.begin(), outcome.iterations,
      has_spider ? static_cast<std::int64_t>(checkpoint.spider->arms.front().size()) - 1 : 0;
  content.residual << outcome.residual;
  if (has_spider) content.mean = checkpoint.spider->mean, content.arms = stackArms(*checkpoint.spider);
  return content;
}

Content readContent(const TensorFile& file) {
  Content content;
  content.kept = file.matrix<std::int32_t>("coarse.kept", -1, 1);
  content.faces = file.matrix<std::int32_t>("coarse.faces", -1, 3);
  content.counts = file.matrix<std::int64_t>("counts", 5, 1);
  content.residual = file.matrix<double>("residual", 1, 1);
  content.mean = file.matrix<double>("mean", -1, 3);
  content.arms = file.matrix<double>("arms", -1, 3);
  return content;
}

const std::string& textOf(const TensorFile& file, const std::string& path, const char* key) {
  const auto found = file.metadata().find(key);
  if (found == file.metadata().end())
    throw InvalidInput(path, "is no checkpoint: its header has no " + std::string(key));
  return found->second;
}

ShellPgaCheckpoint checkpointFrom(const Content& content, const std::string& training) {
  ShellPgaCheckpoint checkpoint;
  checkpoint.training = training;
  checkpoint.coarsening.kept.assign(content.kept.begin(), content.kept.end());
  checkpoint.coarsening.coarse =
      std::make_shared<const Topology>(static_cast<std::int32_t>(content.kept.size()), content.faces);
  checkpoint.mean_ended = content.counts[1] != 0;
  checkpoint.mean = {kTerminations.at(static_cast<std::size_t>(content.counts[2])), static_cast<int>(content.counts[3]),
                     content.residual[0]};
  if (content.counts[0] == 0) return checkpoint;
  const auto steps = content.counts[4];
  const auto count = content.arms.rows() / (steps * content.mean.rows());
  checkpoint.spider = Spider{content.mean, splitArms(content.mean, content.arms, count, steps)};
  return checkpoint;
}

}  // namespace

std::string ShellPgaCheckpoint::stage() const {
  if (!spider) return "coarsening done";
  return mean_ended ? "Frechet mean done" : "Frechet mean, Newton step " + std::to_string(mean.iterations);
}

void writeCheckpoint(const std::filesystem::path& path, const ShellPgaCheckpoint& checkpoint) {
  const auto content = contentOf(checkpoint);
  TensorWriter file;
  file.setMetadata(kFormatKey, kFormat);
  file.setMetadata(kTrainingKey, checkpoint.training);
  file.setMetadata(kHashKey, content.hash(checkpoint.training));
  file.addMatrix("coarse.kept", content.kept);
  file.addMatrix("coarse.faces", content.faces);
  file.addMatrix("counts", content.counts);
  file.addMatrix("residual", content.residual);
  file.addMatrix("mean", content.mean);
  file.addMatrix("arms", content.arms);
  file.write(path);
}

ShellPgaCheckpoint readCheckpoint(const std::filesystem::path& path) {
  const TensorFile file(path);
  if (const auto& format = textOf(file, path.string(), kFormatKey); format != kFormat)
    throw InvalidInput(path.string(), "has the format \"" + format + "\", want \"" + kFormat + "\"");
  const auto& training = textOf(file, path.string(), kTrainingKey);
  const auto content = readContent(file);
  // What the hash covers was written by writeCheckpoint() and needs no further checks.
  if (content.hash(training) != textOf(file, path.string(), kHashKey))
    throw InvalidInput(path.string(), "is damaged: its numbers do not have the SHA-256 that it states");
  return checkpointFrom(content, training);
}

}  // namespace shaped
