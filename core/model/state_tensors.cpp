#include "core/model/state_tensors.h"

#include <algorithm>
#include <array>

namespace shaped {
namespace {

constexpr std::array kTerminations{Termination::kConverged, Termination::kIterationLimit, Termination::kStalled,
                                   Termination::kCancelled, Termination::kNumericalFailure};

}  // namespace

Eigen::RowVector3d numbersOf(const Outcome& outcome) {
  const auto* termination = std::find(kTerminations.begin(), kTerminations.end(), outcome.termination);
  return {static_cast<double>(termination - kTerminations.begin()), static_cast<double>(outcome.iterations),
          outcome.residual};
}

Outcome outcomeOf(const Eigen::RowVector3d& numbers) {
  return {kTerminations.at(static_cast<std::size_t>(numbers[0])), static_cast<int>(numbers[1]), numbers[2]};
}

Vertices stack(const std::vector<Vertices>& shapes) {
  const auto rows = shapes.empty() ? 0 : shapes.front().rows();
  Vertices stacked(std::ssize(shapes) * rows, 3);
  Eigen::Index at = 0;
  for (const auto& shape : shapes) stacked.middleRows(at, rows) = shape, at += rows;
  return stacked;
}

std::vector<Vertices> unstack(const Vertices& stacked, Eigen::Index vertices) {
  std::vector<Vertices> shapes;
  for (Eigen::Index at = 0; at < stacked.rows(); at += vertices) shapes.emplace_back(stacked.middleRows(at, vertices));
  return shapes;
}

void addSpider(const std::string& name, const std::optional<Spider>& spider, TensorWriter& file) {
  std::vector<Vertices> shapes;  // of the arms, without the mean, which begins each
  if (spider)
    for (const auto& arm : spider->arms) shapes.insert(shapes.end(), arm.begin() + 1, arm.end());
  file.addMatrix(name + ".mean", spider ? spider->mean : Vertices(0, 3));
  file.addMatrix(name + ".arms", stack(shapes));
  file.addMatrix(name + ".count", Eigen::Matrix<std::int64_t, 1, 1>(spider ? std::ssize(spider->arms) : 0));
}

std::optional<Spider> readSpider(const TensorFile& file, const std::string& name) {
  const auto count = static_cast<std::size_t>(file.values<std::int64_t>(name + ".count")[0]);
  if (count == 0) return std::nullopt;
  Spider spider{file.matrix<double>(name + ".mean", -1, 3), {}};
  auto shapes = unstack(file.matrix<double>(name + ".arms", -1, 3), spider.mean.rows());
  const auto steps = shapes.size() / count;
  for (std::size_t i = 0; i < count; ++i) {
    auto& arm = spider.arms.emplace_back(Path{spider.mean});
    for (std::size_t k = 0; k < steps; ++k) arm.push_back(std::move(shapes[i * steps + k]));
  }
  return spider;
}

}  // namespace shaped
