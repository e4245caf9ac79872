#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/geodesic/geodesic.h"
#include "core/mesh/coarsening.h"

namespace shaped::experiments {

/// The real data is not where it was looked for.
class MissingData : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A file or folder below the one that SHAPED_DATA names (default ~/.cache/shaped-data). Throws MissingData.
std::filesystem::path dataPath(const std::string& relative);

/// Shapes of one connectivity.
struct DataSet {
  std::string name;
  TopologyPtr topology;
  std::vector<Vertices> shapes;  ///< V x 3 each
};

DataSet cactus();    ///< 19 poses, 5261 vertices
DataSet horse();     ///< 75 poses, 1709 vertices
DataSet cow();       ///< the rest shape and 7 poses, 11666 vertices
DataSet bodies();    ///< 72 poses, 13380 vertices [m]
DataSet bodies1k();  ///< the same on 1250 vertices

/// The set on at most `vertices` of its vertices, coarsened together.
DataSet coarsened(const DataSet& set, int vertices);

/// The shapes at these places.
DataSet subset(const DataSet& set, const std::vector<std::size_t>& indices);

/// Geodesic calculus on the set's mesh with the default bending weight of its first shape.
GeodesicCalculus calculusOf(const DataSet& set);
GeodesicCalculus calculusOf(const DataSet& set, const PairEnergy& energy);

}  // namespace shaped::experiments
