#pragma once

#include <cstdint>
#include <vector>

#include "core/numerics/block_matrix.h"
#include "core/numerics/pins.h"

namespace shaped {

/// The lower triangle of P A P^T as scalar compressed columns, for matrices A over one block pattern and a fixed order
/// of the nodes: made once, so that a factorisation only copies values. Diagonal blocks are stored whole.
class PermutedPattern {
 public:
  /// order: the node that comes first, second, .. in P A P^T.
  PermutedPattern(const BlockPattern& pattern, std::vector<std::int32_t> order);

  std::size_t size() const { return 3 * order_.size(); }  ///< rows and columns
  const std::vector<std::int32_t>& order() const { return order_; }
  const std::vector<int>& begin() const { return begin_; }  ///< of the columns, and the end
  const std::vector<int>& rows() const { return rows_; }    ///< ascending in every column

  /// The values of P A P^T with unit rows and columns in the pinned unknowns; values: as many as rows().
  void copyValues(const SymmetricBlockMatrix& matrix, const Pins& pins, double* values) const;
  /// to = P from, and back; size() entries, not overlapping.
  void permute(const double* from, double* to) const;
  void permuteBack(const double* from, double* to) const;

 private:
  /// Where a block's values come from.
  struct Source {
    std::int32_t lower_slot;
    std::int32_t row;  ///< position in the order
    bool transposed;
  };

  std::vector<std::int32_t> order_;
  std::vector<std::size_t> first_;  ///< of a column's sources, and the end
  std::vector<Source> sources_;
  std::vector<int> begin_, rows_;
};

}  // namespace shaped
