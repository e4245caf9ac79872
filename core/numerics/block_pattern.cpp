#include "core/numerics/block_pattern.h"

#include <algorithm>

namespace shaped {

BlockPattern::BlockPattern(std::int32_t node_count, const std::vector<std::vector<std::int32_t>>& stencils) {
  std::vector<std::vector<std::int32_t>> columns(static_cast<std::size_t>(node_count));
  for (std::int32_t node = 0; node < node_count; ++node) columns[node].push_back(node);
  for (const auto& stencil : stencils)
    for (const auto column : stencil) columns[column].insert(columns[column].end(), stencil.begin(), stencil.end());
  begin_.push_back(0);
  lower_begin_.push_back(0);
  for (std::int32_t column = 0; column < node_count; ++column) {
    auto& rows = columns[column];
    std::sort(rows.begin(), rows.end());
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
    rows_.insert(rows_.end(), rows.begin(), rows.end());
    begin_.push_back(static_cast<std::int32_t>(rows_.size()));
    const auto lower = rows.end() - std::lower_bound(rows.begin(), rows.end(), column);
    lower_begin_.push_back(lower_begin_.back() + static_cast<std::int32_t>(lower));
  }
}

std::int32_t BlockPattern::slot(std::int32_t row, std::int32_t column) const {
  const auto all = rows(column);
  return begin_[column] + static_cast<std::int32_t>(std::lower_bound(all.begin(), all.end(), row) - all.begin());
}

std::int32_t BlockPattern::lowerSlot(std::int32_t row, std::int32_t column) const {
  const auto lower = lowerRows(column);
  return lower_begin_[column] + static_cast<std::int32_t>(std::lower_bound(lower.begin(), lower.end(), row) - lower.begin());
}

}  // namespace shaped
