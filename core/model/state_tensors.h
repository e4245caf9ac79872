#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/io/tensor_file.h"
#include "core/statistics/frechet_mean.h"

namespace shaped {

/// How the parts that checkpoints have in common lie in tensor files. What is read was written by these functions: the
/// file is sealed (core/io/sealed_tensors.h).

/// Termination, iterations, residual.
Eigen::RowVector3d numbersOf(const Outcome& outcome);
Outcome outcomeOf(const Eigen::RowVector3d& numbers);

/// Shapes of as many vertices each below each other, and back.
Vertices stack(const std::vector<Vertices>& shapes);
std::vector<Vertices> unstack(const Vertices& stacked, Eigen::Index vertices);

/// `name`.mean, `name`.arms and their counts; all empty without a spider.
void addSpider(const std::string& name, const std::optional<Spider>& spider, TensorWriter& file);
std::optional<Spider> readSpider(const TensorFile& file, const std::string& name);

}  // namespace shaped
