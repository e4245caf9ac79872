#pragma once

#include <cstdint>
#include <vector>

namespace shaped {

/// Unknowns that a solver must leave alone: handles, and the six that remove the rigid motions. Three per node.
class Pins {
 public:
  Pins() = default;
  explicit Pins(std::int32_t node_count) : pinned_(3 * static_cast<std::size_t>(node_count), 0) {}

  /// axis: 0, 1 or 2.
  void pin(std::int32_t node, int axis) { pinned_[3 * static_cast<std::size_t>(node) + static_cast<std::size_t>(axis)] = 1; }
  void pinAll(std::int32_t node) {
    for (int axis = 0; axis < 3; ++axis) pin(node, axis);
  }

  bool pinned(std::size_t unknown) const { return pinned_[unknown] != 0; }
  bool anyPinned(std::int32_t node) const {
    const auto* p = pinned_.data() + 3 * static_cast<std::size_t>(node);
    return p[0] | p[1] | p[2];
  }
  std::size_t size() const { return pinned_.size(); }

  /// Sets the pinned entries of a vector to zero.
  void clear(double* vector) const {
    for (std::size_t i = 0; i < pinned_.size(); ++i)
      if (pinned_[i]) vector[i] = 0;
  }

 private:
  std::vector<std::uint8_t> pinned_;
};

}  // namespace shaped
