#ifdef SHAPED_SUPERNODAL

#include "core/numerics/nested_dissection.h"

#include <metis.h>

#include <numeric>
#include <stdexcept>
#include <string>

#include "core/numerics/long_piece.h"
#include "core/numerics/metis_isolation.h"

namespace shaped {
namespace {

constexpr std::size_t kLargestWhole = 3000;  ///< nodes that METIS orders at once, in some 10 ms

/// A part of the pattern's graph.
struct Graph {
  std::vector<std::int32_t> nodes;  ///< of the pattern
  std::vector<idx_t> begin{0}, neighbours;
};

Graph graphOf(const BlockPattern& pattern) {
  Graph graph;
  graph.nodes.resize(static_cast<std::size_t>(pattern.nodeCount()));
  std::iota(graph.nodes.begin(), graph.nodes.end(), 0);
  for (const auto node : graph.nodes) {
    for (const auto row : pattern.rows(node))
      if (row != node) graph.neighbours.push_back(row);
    graph.begin.push_back(static_cast<idx_t>(graph.neighbours.size()));
  }
  return graph;
}

void require(int status, std::size_t nodes) {
  if (status != METIS_OK)
    throw std::runtime_error("METIS could not order a matrix of " + std::to_string(nodes) + " nodes");
}

/// The nodes on one side, with the edges between them.
Graph partOf(const Graph& graph, const std::vector<idx_t>& sides, idx_t side) {
  Graph part;
  std::vector<idx_t> position(graph.nodes.size(), -1);
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    if (sides[i] != side) continue;
    position[i] = static_cast<idx_t>(part.nodes.size());
    part.nodes.push_back(graph.nodes[i]);
  }
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    if (sides[i] != side) continue;
    for (auto k = graph.begin[i]; k < graph.begin[i + 1]; ++k)
      if (const auto other = position[static_cast<std::size_t>(graph.neighbours[static_cast<std::size_t>(k)])];
          other >= 0)
        part.neighbours.push_back(other);
    part.begin.push_back(static_cast<idx_t>(part.neighbours.size()));
  }
  return part;
}

void appendWhole(Graph& graph, std::vector<std::int32_t>& order) {
  const LongPiece piece("nested dissection");
  auto count = static_cast<idx_t>(graph.nodes.size());
  std::vector<idx_t> local(graph.nodes.size()), inverse(graph.nodes.size());
  const MetisIsolation isolation;
  require(
      METIS_NodeND(&count, graph.begin.data(), graph.neighbours.data(), nullptr, nullptr, local.data(), inverse.data()),
      graph.nodes.size());
  for (const auto i : local) order.push_back(graph.nodes[static_cast<std::size_t>(i)]);
}

/// Which side of a separator each node is on; 2: the separator.
std::vector<idx_t> sidesOf(Graph& graph) {
  const LongPiece piece("separator");
  auto count = static_cast<idx_t>(graph.nodes.size());
  idx_t size = 0;
  std::vector<idx_t> sides(graph.nodes.size());
  const MetisIsolation isolation;
  require(METIS_ComputeVertexSeparator(&count, graph.begin.data(), graph.neighbours.data(), nullptr, nullptr, &size,
                                       sides.data()),
          graph.nodes.size());
  return sides;
}

void append(Graph graph, std::vector<std::int32_t>& order, const std::stop_token& stop) {
  if (stop.stop_requested()) return;
  if (graph.nodes.size() <= kLargestWhole) return appendWhole(graph, order);
  const auto sides = sidesOf(graph);
  Graph one = partOf(graph, sides, 0), other = partOf(graph, sides, 1);
  if (std::max(one.nodes.size(), other.nodes.size()) == graph.nodes.size()) return appendWhole(graph, order);
  for (auto* part : {&one, &other})
    if (!part->nodes.empty()) append(std::move(*part), order, stop);
  for (std::size_t i = 0; i < sides.size(); ++i)
    if (sides[i] == 2) order.push_back(graph.nodes[i]);
}

}  // namespace

std::vector<std::int32_t> nestedDissection(const BlockPattern& pattern, const std::stop_token& stop) {
  std::vector<std::int32_t> order;
  append(graphOf(pattern), order, stop);
  if (stop.stop_requested()) return {};
  return order;
}

}  // namespace shaped

#endif
