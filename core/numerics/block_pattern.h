#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace shaped {

/// Which 3 x 3 blocks of a square matrix over n nodes are stored: node pairs that meet in a stencil, and the diagonal.
/// Symmetric in structure. Immutable; shared by every matrix over one topology.
class BlockPattern {
 public:
  /// stencils: groups of nodes in [0, node_count) that all couple with each other.
  BlockPattern(std::int32_t node_count, const std::vector<std::vector<std::int32_t>>& stencils);

  std::int32_t nodeCount() const { return static_cast<std::int32_t>(begin_.size()) - 1; }
  std::int32_t blockCount() const { return begin_.back(); }
  std::int32_t lowerBlockCount() const { return lower_begin_.back(); }

  /// Rows of the blocks in a column, ascending; the diagonal block is among them.
  std::span<const std::int32_t> rows(std::int32_t column) const {
    return {rows_.data() + begin_[column], rows_.data() + begin_[column + 1]};
  }
  /// Slot of the first stored block of a column, all blocks counted.
  std::int32_t begin(std::int32_t column) const { return begin_[column]; }
  /// Slot of the first stored block of a column where only blocks on and below the diagonal count.
  std::int32_t lowerBegin(std::int32_t column) const { return lower_begin_[column]; }
  /// Rows on and below the diagonal, ascending, the diagonal first.
  std::span<const std::int32_t> lowerRows(std::int32_t column) const {
    const auto all = rows(column);
    return all.last(static_cast<std::size_t>(lower_begin_[column + 1] - lower_begin_[column]));
  }

  /// Slot among all blocks; the block must exist.
  std::int32_t slot(std::int32_t row, std::int32_t column) const;
  /// Slot among the lower blocks; row >= column, and the block must exist.
  std::int32_t lowerSlot(std::int32_t row, std::int32_t column) const;

 private:
  std::vector<std::int32_t> begin_, lower_begin_, rows_;
};

using BlockPatternPtr = std::shared_ptr<const BlockPattern>;

}  // namespace shaped
