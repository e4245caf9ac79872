#pragma once

#include <vector>

#include "core/mesh/types.h"
#include "core/sample/random.h"

namespace shaped {

/// A point of a mesh: a face and the weights of its corners.
struct SurfaceSample {
  std::int32_t face;
  Eigen::RowVector3d barycentric;  ///< non-negative, sum 1
};

/// Draws points of a mesh's surface, evenly by area.
class SurfaceSampler {
 public:
  /// vertices: V x 3; faces: F x 3. Throws InvalidInput naming `vertices` or `faces` when there is no face, an index is
  /// out of range, a coordinate is not finite or no face has area.
  SurfaceSampler(const Vertices& vertices, const Faces& faces);

  /// The next point; takes three numbers of the sequence.
  SurfaceSample operator()(Random& random) const;

 private:
  std::vector<double> area_up_to_;  ///< of the faces up to and with each [m^2]
};

/// Where the sample is: the mean of its corners' rows (positions, normals, colours), weighted.
Eigen::RowVector3d at(const SurfaceSample& sample, const Faces& faces, const Vertices& rows);

}  // namespace shaped
