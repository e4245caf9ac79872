#include "core/mesh/surface_neighbours.h"

#include <algorithm>
#include <functional>
#include <queue>
#include <tuple>

namespace shaped {
namespace {

/// Dijkstra's method from all marks at once, where every vertex is met by the `count` marks that come first: the way
/// from a mark to a vertex leads only over vertices among whose nearest marks it is too.
class NeighbourSearch {
 public:
  NeighbourSearch(const Topology& topology, const Vertices& shape, int count)
      : count_(static_cast<std::size_t>(count)),
        first_(static_cast<std::size_t>(topology.vertexCount()) + 1, 0),
        spokes_(2 * topology.edges().size()),
        found_(static_cast<std::size_t>(topology.vertexCount())) {
    for (const auto& edge : topology.edges())
      for (const auto end : edge) ++first_[end + 1];
    for (std::size_t v = 1; v < first_.size(); ++v) first_[v] += first_[v - 1];
    auto next = first_;
    for (const auto& [a, b] : topology.edges()) {
      const double length = (shape.row(a) - shape.row(b)).norm();
      spokes_[next[a]++] = {b, length};
      spokes_[next[b]++] = {a, length};
    }
  }

  std::vector<SurfaceNeighbours> run(const std::vector<std::int32_t>& marked, const std::stop_token& stop) {
    for (std::size_t m = 0; m < marked.size(); ++m) front_.emplace(0, static_cast<std::int32_t>(m), marked[m]);
    while (!front_.empty()) {
      if (stop.stop_requested()) return {};
      const auto [distance, mark, v] = front_.top();
      front_.pop();
      if (!takes(v, mark)) continue;
      found_[v].push_back({mark, distance});
      for (auto s = first_[v]; s < first_[v + 1]; ++s)
        if (takes(spokes_[s].to, mark)) front_.emplace(distance + spokes_[s].length, mark, spokes_[s].to);
    }
    return std::move(found_);
  }

 private:
  struct Spoke {
    std::int32_t to;
    double length;
  };
  using Reached = std::tuple<double, std::int32_t, std::int32_t>;  ///< distance, mark, vertex

  /// Has the vertex room for the mark, and has not met it on a shorter way?
  bool takes(std::int32_t v, std::int32_t mark) const {
    const auto& found = found_[v];
    return found.size() < count_ &&
           std::none_of(found.begin(), found.end(), [&](const auto& neighbour) { return neighbour.mark == mark; });
  }

  std::size_t count_;
  std::vector<std::size_t> first_;  ///< of a vertex's spokes, and the end
  std::vector<Spoke> spokes_;
  std::vector<SurfaceNeighbours> found_;
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> front_;
};

}  // namespace

std::vector<SurfaceNeighbours> nearestMarked(const Topology& topology, const Vertices& shape,
                                             const std::vector<std::int32_t>& marked, int count,
                                             const std::stop_token& stop) {
  return NeighbourSearch(topology, shape, count).run(marked, stop);
}

}  // namespace shaped
