#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/mesh/topology.h"

namespace shaped {

/// Shapes of as many vertices each that lie below each other in memory, which is theirs or somebody else's: a mapped
/// file's, for one. Immutable; copies share the memory and keep its owner alive. Safe to read from any thread.
class ShapeStack {
 public:
  using Shape = Eigen::Map<const Vertices>;

  ShapeStack() = default;
  /// Copies the shapes. Throws InvalidInput naming shapes[i] when one has another number of vertices than the first.
  explicit ShapeStack(const std::vector<Vertices>& shapes);
  /// Shares `count` shapes of `vertices` rows that begin at `numbers` and stay as they are while `owner` lives. bytes:
  /// what the owner takes of memory, at least the shapes.
  ShapeStack(std::shared_ptr<const void> owner, const double* numbers, std::size_t count, Eigen::Index vertices,
             std::size_t bytes);

  std::size_t size() const { return count_; }
  bool empty() const { return count_ == 0; }
  /// V x 3, valid while this or a copy lives.
  Shape operator[](std::size_t i) const {
    return {numbers_ + 3 * static_cast<Eigen::Index>(i) * vertices_, vertices_, 3};
  }
  /// All shapes, (size V) x 3.
  Shape stacked() const { return {numbers_, static_cast<Eigen::Index>(count_) * vertices_, 3}; }
  /// Copies of them.
  std::vector<Vertices> shapes() const;
  /// Memory that this keeps alive, with whatever else its owner holds.
  std::size_t bytes() const { return bytes_; }

  bool operator==(const ShapeStack& other) const {
    return count_ == other.count_ && vertices_ == other.vertices_ && stacked() == other.stacked();
  }

 private:
  std::shared_ptr<const void> owner_;
  const double* numbers_ = nullptr;
  std::size_t count_ = 0, bytes_ = 0;
  Eigen::Index vertices_ = 0;
};

/// requireValidShape() of each, in one pass over their memory; errors name `field`[i].
void requireValidShapes(const Topology& topology, const ShapeStack& shapes, const std::string& field);

}  // namespace shaped
