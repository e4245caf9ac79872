#include "core/model/sparse_tensors.h"

#include <cmath>

#include "core/numerics/error.h"

namespace shaped {

void addSparse(TensorWriter& tensors, const std::string& name, const SparseRows& matrix) {
  SparseRows compressed = matrix;
  compressed.makeCompressed();
  const auto entries = static_cast<std::size_t>(compressed.nonZeros());
  tensors.add(
      name + ".row_begin", {compressed.rows() + 1},
      std::span<const std::int32_t>(compressed.outerIndexPtr(), static_cast<std::size_t>(compressed.rows()) + 1));
  tensors.add(name + ".columns", {compressed.nonZeros()},
              std::span<const std::int32_t>(compressed.innerIndexPtr(), entries));
  tensors.add(name + ".values", {compressed.nonZeros()}, std::span<const double>(compressed.valuePtr(), entries));
}

SparseRows sparseFrom(const TensorFile& tensors, const std::string& name, Eigen::Index rows, Eigen::Index columns) {
  const auto begin = tensors.values<std::int32_t>(name + ".row_begin");
  const auto index = tensors.values<std::int32_t>(name + ".columns");
  const auto values = tensors.values<double>(name + ".values");
  const auto fail = [&](const char* why) { throw InvalidInput(name, why); };
  if (static_cast<Eigen::Index>(begin.size()) != rows + 1 || index.size() != values.size()) fail("has the wrong size");
  if (begin.front() != 0 || static_cast<std::size_t>(begin.back()) != values.size()) fail("has broken row limits");
  std::vector<Eigen::Triplet<double>> triplets;
  triplets.reserve(values.size());
  for (Eigen::Index row = 0; row < rows; ++row) {
    const auto first = begin[static_cast<std::size_t>(row)], last = begin[static_cast<std::size_t>(row) + 1];
    if (first > last || last > begin.back()) fail("has broken row limits");
    for (auto k = first; k < last; ++k) {
      const auto column = index[static_cast<std::size_t>(k)];
      if (column < 0 || column >= columns) fail("has a column out of range");
      if (!std::isfinite(values[static_cast<std::size_t>(k)])) fail("has a number that is not finite");
      triplets.emplace_back(static_cast<int>(row), column, values[static_cast<std::size_t>(k)]);
    }
  }
  SparseRows matrix(rows, columns);
  matrix.setFromTriplets(triplets.begin(), triplets.end());
  return matrix;
}

}  // namespace shaped
