#include <vector>

#include "core/io/mesh_formats.h"
#include "core/io/npy.h"
#include "core/numerics/error.h"

namespace shaped {

void parseNpyPoints(const std::string& file, std::string_view bytes, PolygonSoup& soup) {
  const auto header = parseNpyHeader(file, bytes, bytes.size());
  if (header.shape.size() != 2 || (header.shape[1] != 3 && header.shape[1] != 6))
    throw InvalidInput(file, "is no list of points; want an array N x 3, or N x 6 with normals");
  std::vector<double> values(static_cast<std::size_t>(header.valueCount()));
  decodeNpyValues(header, bytes.substr(header.size), values);
  const auto columns = static_cast<std::size_t>(header.shape[1]);
  for (std::size_t i = 0; i < values.size(); i += columns) {
    soup.addVertex(values[i], values[i + 1], values[i + 2]);
    if (columns == 6 && soup.keepsNormals()) soup.addNormal(values[i + 3], values[i + 4], values[i + 5]);
  }
}

}  // namespace shaped
