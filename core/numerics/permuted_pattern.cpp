#include "core/numerics/permuted_pattern.h"

#include <algorithm>

namespace shaped {
namespace {

/// Overwrites the pinned rows and columns of one block with those of the identity.
void pinBlock(const Pins& pins, std::int32_t row, std::int32_t column, double* values, std::size_t stride) {
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t r = 0; r < 3; ++r) {
      const std::size_t i = 3 * static_cast<std::size_t>(row) + r, j = 3 * static_cast<std::size_t>(column) + c;
      if (pins.pinned(i) || pins.pinned(j)) values[c * stride + r] = i == j ? 1 : 0;
    }
}

}  // namespace

PermutedPattern::PermutedPattern(const BlockPattern& pattern, std::vector<std::int32_t> order)
    : order_(std::move(order)) {
  std::vector<std::int32_t> position(order_.size());
  for (std::size_t i = 0; i < order_.size(); ++i) position[order_[i]] = static_cast<std::int32_t>(i);
  for (std::size_t column = 0; column < order_.size(); ++column) {
    first_.push_back(sources_.size());
    const auto node = order_[column];
    for (const auto other : pattern.rows(node))
      if (position[other] >= static_cast<std::int32_t>(column))
        sources_.push_back(
            {pattern.lowerSlot(std::max(node, other), std::min(node, other)), position[other], other < node});
    std::sort(sources_.begin() + static_cast<std::ptrdiff_t>(first_.back()), sources_.end(),
              [](const Source& a, const Source& b) { return a.row < b.row; });
    for (int c = 0; c < 3; ++c) {
      begin_.push_back(static_cast<int>(rows_.size()));
      for (std::size_t s = first_.back(); s < sources_.size(); ++s)
        for (int r = 0; r < 3; ++r) rows_.push_back(3 * sources_[s].row + r);
    }
  }
  first_.push_back(sources_.size());
  begin_.push_back(static_cast<int>(rows_.size()));
}

void PermutedPattern::copyValues(const SymmetricBlockMatrix& matrix, const Pins& pins, double* values) const {
  for (std::size_t column = 0; column < order_.size(); ++column) {
    const std::size_t stride = 3 * (first_[column + 1] - first_[column]);
    const bool column_pinned = pins.anyPinned(order_[column]);
    double* out = values + 9 * first_[column];
    for (std::size_t s = first_[column]; s < first_[column + 1]; ++s, out += 3) {
      const auto& source = sources_[s];
      const double* block = matrix.block(source.lower_slot);
      const std::size_t by_row = source.transposed ? 3 : 1, by_column = source.transposed ? 1 : 3;
      for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t r = 0; r < 3; ++r) out[c * stride + r] = block[by_column * c + by_row * r];
      const auto row = order_[source.row];
      if (column_pinned || pins.anyPinned(row)) pinBlock(pins, row, order_[column], out, stride);
    }
  }
}

void PermutedPattern::permute(const double* from, double* to) const {
  for (const auto node : order_)
    for (std::size_t axis = 0; axis < 3; ++axis) *to++ = from[3 * static_cast<std::size_t>(node) + axis];
}

void PermutedPattern::permuteBack(const double* from, double* to) const {
  for (const auto node : order_)
    for (std::size_t axis = 0; axis < 3; ++axis) to[3 * static_cast<std::size_t>(node) + axis] = *from++;
}

}  // namespace shaped
