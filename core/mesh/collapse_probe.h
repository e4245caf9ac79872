#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/mesh/shape_group.h"

namespace shaped {

/// The surroundings of a vertex that a collapse removes: its triangles (from, b, c) in cyclic order, and beyond each of
/// their outer edges the tip of the neighbouring triangle.
struct CollapseStar {
  std::int32_t from = 0, to = 0;
  std::vector<std::array<std::int32_t, 2>> outer_edges;  ///< (b, c) of each triangle
  std::vector<std::int32_t> tips;                        ///< beyond each outer edge; -1 at a boundary
  bool closed = true;                                    ///< the last triangle meets the first
};

/// Judges what a collapse does to the triangles of all shapes at once. Keeps scratch: one per thread.
///
/// The regularity of a piece of surface is min(q / 0.2, (1 + f) / 0.5), where q is its smallest triangle quality
/// (triangleQualities) and f the smallest cosine between the normals of adjacent triangles: 1 where a triangle is thin
/// enough or a hinge folded enough (120 degrees) to hurt a shell energy, 0 for a sliver or a sheet folded flat.
class CollapseProbe {
 public:
  /// How the regularity around `star.from` changes: `before` and `after` are the smallest over all shapes.
  struct Verdict {
    bool acceptable = false;
    double before = 0, after = 0;
  };

  /// A collapse is acceptable when the regularity of every shape stays above `floor` or at least where it was, and
  /// triangles turn by more than 70 degrees only in shapes where that unfolds them: from a regularity below 0.5 to one
  /// at least a fifth better.
  Verdict judge(const ShapeGroup& shapes, const CollapseStar& star, double floor);

 private:
  using Values = ShapeGroup::Values;
  /// One vector per shape, by coordinates.
  struct Vectors {
    Values x, y, z;
    auto dot(const Vectors& other) const { return x * other.x + y * other.y + z * other.z; }
  };

  void setNormal(Vectors& normal, const ShapeGroup& shapes, std::int32_t apex, std::int32_t b, std::int32_t c);
  void measureTriangles(const ShapeGroup& shapes, const CollapseStar& star);
  void measureFolds(const CollapseStar& star);

  std::vector<Vectors> before_, after_, beyond_;  ///< unit normals of the star's triangles and of their neighbours
  std::vector<char> survives_;                    ///< which triangles do not contain `to`
  Vectors base_, side_;
  Values squared_quality_, length_, turn_;
  Values quality_before_, quality_after_, fold_before_, fold_after_;  ///< smallest, per shape
};

}  // namespace shaped
