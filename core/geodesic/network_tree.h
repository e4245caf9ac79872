#pragma once

#include <cstdint>
#include <vector>

namespace shaped {

struct ElasticNetwork;

/// The forest of a network's free nodes, rooted in each tree's node with the most segments.
struct NetworkTree {
  struct Node {
    std::int32_t index;                  ///< in the network
    std::int32_t parent = -1;            ///< position among the free nodes, -1 for a root
    std::int32_t parent_segment = -1;    ///< segment to the parent
    std::vector<std::int32_t> children;  ///< positions among the free nodes
    std::vector<std::int32_t> segments;  ///< all segments that end here
    /// Pivot of the weighted graph Laplacian when eliminating from the leaves, over the diagonal entry: in (0, 1].
    double pivot_ratio = 1;
  };

  std::vector<Node> nodes;                         ///< the free nodes
  std::vector<std::vector<std::int32_t>> levels;   ///< positions by distance from the root

  /// Throws InvalidInput when the segments between free nodes close a loop, name an unknown node or join a node to
  /// itself, or when a tree of free nodes has no segment to a fixed one.
  explicit NetworkTree(const ElasticNetwork& network);
};

}  // namespace shaped
