#include "core/mesh/surface_neighbours.h"

#include <functional>
#include <limits>
#include <queue>
#include <utility>

namespace shaped {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();

/// Dijkstra's method from one vertex after another, each ended as soon as enough marks are met.
class NeighbourSearch {
 public:
  NeighbourSearch(const Topology& topology, const Vertices& shape, const std::vector<std::int32_t>& marked)
      : spokes_(static_cast<std::size_t>(topology.vertexCount())),
        mark_(static_cast<std::size_t>(topology.vertexCount()), -1),
        distance_(static_cast<std::size_t>(topology.vertexCount()), kFar) {
    for (const auto& [a, b] : topology.edges()) {
      const double length = (shape.row(a) - shape.row(b)).norm();
      spokes_[a].push_back({b, length});
      spokes_[b].push_back({a, length});
    }
    for (std::size_t m = 0; m < marked.size(); ++m) mark_[marked[m]] = static_cast<std::int32_t>(m);
  }

  SurfaceNeighbours operator()(std::int32_t start, int count) {
    SurfaceNeighbours found;
    reach(start, 0);
    while (!front_.empty() && static_cast<int>(found.size()) < count) {
      const auto [distance, v] = front_.top();
      front_.pop();
      if (distance > distance_[v]) continue;  // reached on a shorter way since
      if (mark_[v] >= 0) found.push_back({mark_[v], distance});
      for (const auto& [next, length] : spokes_[v])
        if (distance + length < distance_[next]) reach(next, distance + length);
    }
    clear();
    return found;
  }

 private:
  struct Spoke {
    std::int32_t to;
    double length;
  };
  using Reached = std::pair<double, std::int32_t>;

  void reach(std::int32_t v, double distance) {
    if (distance_[v] == kFar) touched_.push_back(v);
    distance_[v] = distance;
    front_.emplace(distance, v);
  }

  void clear() {
    for (const auto v : touched_) distance_[v] = kFar;
    touched_.clear();
    front_ = {};
  }

  std::vector<std::vector<Spoke>> spokes_;
  std::vector<std::int32_t> mark_;
  std::vector<double> distance_;
  std::vector<std::int32_t> touched_;
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> front_;
};

}  // namespace

std::vector<SurfaceNeighbours> nearestMarked(const Topology& topology, const Vertices& shape,
                                             const std::vector<std::int32_t>& marked, int count) {
  NeighbourSearch search(topology, shape, marked);
  std::vector<SurfaceNeighbours> result(static_cast<std::size_t>(topology.vertexCount()));
  for (std::int32_t v = 0; v < topology.vertexCount(); ++v) result[v] = search(v, count);
  return result;
}

}  // namespace shaped
