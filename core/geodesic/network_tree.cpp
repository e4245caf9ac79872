#include "core/geodesic/network_tree.h"

#include <algorithm>
#include <string>

#include "core/geodesic/elastic_network.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

std::int32_t otherEnd(const ElasticSegment& segment, std::int32_t node) {
  return segment.from == node ? segment.to : segment.from;
}

void checkSegments(const ElasticNetwork& network) {
  const auto count = static_cast<std::int32_t>(network.nodes.size());
  for (std::size_t s = 0; s < network.segments.size(); ++s) {
    const auto& segment = network.segments[s];
    const std::string field = "segments[" + std::to_string(s) + "]";
    if (segment.from < 0 || segment.from >= count || segment.to < 0 || segment.to >= count)
      throw InvalidInput(field, "names a node that does not exist");
    if (segment.from == segment.to) throw InvalidInput(field, "joins a node to itself");
    if (!(segment.weight > 0)) throw InvalidInput(field, "needs a positive weight");
  }
}

/// Orders the tree that holds `root` by breadth-first search.
class TreeBuilder {
 public:
  TreeBuilder(const ElasticNetwork& network, NetworkTree& tree) : network_(network), tree_(tree), position_(network.nodes.size(), -1), depth_(network.nodes.size(), -1) {
    for (std::size_t n = 0; n < tree.nodes.size(); ++n) position_[static_cast<std::size_t>(tree.nodes[n].index)] = static_cast<std::int32_t>(n);
  }

  bool visited(std::size_t n) const { return depth_[n] >= 0; }

  void grow(std::int32_t root) {
    depth_[static_cast<std::size_t>(root)] = 0;
    std::vector<std::int32_t> queue{root};
    bool anchored = false;
    for (std::size_t next = 0; next < queue.size(); ++next) {
      const auto n = queue[next];
      const auto depth = static_cast<std::size_t>(depth_[static_cast<std::size_t>(n)]);
      if (tree_.levels.size() <= depth) tree_.levels.emplace_back();
      tree_.levels[depth].push_back(n);
      for (const auto s : tree_.nodes[static_cast<std::size_t>(n)].segments) anchored |= !visit(n, s, queue);
    }
    if (!anchored) throw InvalidInput("segments", "leave a group of free nodes without a fixed one");
  }

 private:
  /// False when the segment's other end is fixed.
  bool visit(std::int32_t n, std::int32_t s, std::vector<std::int32_t>& queue) {
    auto& node = tree_.nodes[static_cast<std::size_t>(n)];
    if (s == node.parent_segment) return true;
    const auto child = position_[static_cast<std::size_t>(otherEnd(network_.segments[static_cast<std::size_t>(s)], node.index))];
    if (child < 0) return false;
    if (visited(static_cast<std::size_t>(child))) throw InvalidInput("segments", "close a loop of free nodes");
    depth_[static_cast<std::size_t>(child)] = depth_[static_cast<std::size_t>(n)] + 1;
    tree_.nodes[static_cast<std::size_t>(child)].parent = n;
    tree_.nodes[static_cast<std::size_t>(child)].parent_segment = s;
    node.children.push_back(child);
    queue.push_back(child);
    return true;
  }

  const ElasticNetwork& network_;
  NetworkTree& tree_;
  std::vector<std::int32_t> position_, depth_;
};

/// Pivots of the graph Laplacian, from the leaves up.
void computePivots(const ElasticNetwork& network, NetworkTree& tree) {
  std::vector<double> pivot(tree.nodes.size());
  for (auto level = tree.levels.rbegin(); level != tree.levels.rend(); ++level)
    for (const auto n : *level) {
      auto& node = tree.nodes[static_cast<std::size_t>(n)];
      double diagonal = 0;
      for (const auto s : node.segments) diagonal += network.segments[static_cast<std::size_t>(s)].weight;
      double eliminated = diagonal;
      for (const auto child : node.children) {
        const double weight = network.segments[static_cast<std::size_t>(tree.nodes[static_cast<std::size_t>(child)].parent_segment)].weight;
        eliminated -= weight * weight / pivot[static_cast<std::size_t>(child)];
      }
      pivot[static_cast<std::size_t>(n)] = eliminated;
      node.pivot_ratio = eliminated / diagonal;
    }
}

}  // namespace

NetworkTree::NetworkTree(const ElasticNetwork& network) {
  checkSegments(network);
  for (std::size_t n = 0; n < network.nodes.size(); ++n)
    if (network.free[n]) {
      Node node{};
      node.index = static_cast<std::int32_t>(n);
      node.parent = node.parent_segment = -1;
      node.pivot_ratio = 1;
      for (std::size_t s = 0; s < network.segments.size(); ++s)
        if (network.segments[s].from == node.index || network.segments[s].to == node.index)
          node.segments.push_back(static_cast<std::int32_t>(s));
      nodes.push_back(std::move(node));
    }
  TreeBuilder builder(network, *this);
  std::vector<std::int32_t> order(nodes.size());
  for (std::size_t n = 0; n < order.size(); ++n) order[n] = static_cast<std::int32_t>(n);
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) {
    return nodes[static_cast<std::size_t>(a)].segments.size() > nodes[static_cast<std::size_t>(b)].segments.size();
  });
  for (const auto root : order)
    if (!builder.visited(static_cast<std::size_t>(root))) builder.grow(root);
  computePivots(network, *this);
}

}  // namespace shaped
