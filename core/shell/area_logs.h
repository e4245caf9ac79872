#pragma once

#include <algorithm>
#include <array>

#include "core/numerics/vector_math.h"
#include "core/shell/measures.h"

namespace shaped {

/// log A of a shape's faces, or log(A / a) relative to another shape, computed a batch at a time by vector
/// instructions. Faces must be asked for in ascending order, each from 0 on.
class AreaLogs {
 public:
  explicit AreaLogs(const ShellMeasures& shape) : AreaLogs(shape, nullptr) {}
  AreaLogs(const ShellMeasures& shape, const ShellMeasures& relative_to) : AreaLogs(shape, relative_to.area.data()) {}

  double at(std::size_t face) {
    if (face % kBatch == 0) fill(face);
    return logs_[face % kBatch];
  }

 private:
  static constexpr std::size_t kBatch = 128;

  AreaLogs(const ShellMeasures& shape, const double* relative_to)
      : area_(shape.area.data()), relative_to_(relative_to), count_(static_cast<std::size_t>(shape.area.size())) {}

  void fill(std::size_t begin) {
    const std::size_t count = std::min(kBatch, count_ - begin);
    for (std::size_t i = 0; i < count; ++i)
      logs_[i] = relative_to_ ? area_[begin + i] / relative_to_[begin + i] : area_[begin + i];
    logarithms({logs_.data(), count}, {logs_.data(), count});
  }

  const double *area_, *relative_to_;
  std::size_t count_;
  std::array<double, kBatch> logs_;
};

}  // namespace shaped
