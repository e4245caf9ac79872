#include "tests/support/calculus.h"

#include <algorithm>
#include <cmath>

#include "core/mesh/alignment.h"
#include "core/shell/energy.h"

namespace shaped::test {

GeodesicCalculus calculusOn(const Mesh& mesh) {
  return {std::make_shared<const ShellStructure>(mesh.topology), defaultBending(mesh.vertices)};
}

Vertices curl(const Vertices& sheet, double angle) {
  Vertices upright = sheet;
  upright.col(1).swap(upright.col(2));
  Vertices rolled = bend(upright, angle);
  rolled.col(1).swap(rolled.col(2));
  return rolled;
}

double rigidGap(const Vertices& a, const Vertices& b) {
  return (apply(alignRigidly(a, b), a) - b).rowwise().norm().maxCoeff();
}

double order(double coarse_error, double fine_error) { return std::log2(coarse_error / fine_error); }

double speedRatio(const GeodesicCalculus& calculus, const Path& path) {
  const auto energies = calculus.segmentEnergies(path);
  const auto [least, most] = std::minmax_element(energies.begin(), energies.end());
  return *most / *least;
}

}  // namespace shaped::test
