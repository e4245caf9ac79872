#include "tests/support/models.h"

#include <stdexcept>

#include "core/model/shell_pga_training.h"
#include "tests/support/shapes.h"

namespace shaped::test {
namespace {

const Mesh& straightTube() {
  static const Mesh mesh = tube(20, 8);
  return mesh;
}

}  // namespace

Vertices bentTube(double angle) { return bend(straightTube().vertices, angle); }

ShellPgaModelPtr tubeModel() {
  static const ShellPgaModelPtr model = [] {
    ShellPgaTrainingSet set{straightTube().topology, {}, {}};
    for (const double angle : {-0.9, -0.4, 0.2, 0.8}) set.shapes.push_back(bentTube(angle));
    set.shapes[1].col(2) *= 1.2;
    ShellPgaTrainingOptions options;
    options.modes = 2;
    options.coarse_vertices = 60;
    const auto trained = trainShellPga(set, options, {}, {});
    if (!trained.converged()) throw std::runtime_error("the test model did not converge");
    return trained.solution;
  }();
  return model;
}

ShellPgaTrainingSet fourTubes() {
  const auto mesh = tube(20, 8);
  ShellPgaTrainingSet set{mesh.topology, {}, {}};
  for (const double angle : {-0.9, -0.3, 0.2, 0.8}) set.shapes.push_back(bend(mesh.vertices, angle));
  set.shapes[1].col(2) *= 1.2;
  return set;
}

ShellPgaTrainingOptions smallTraining() {
  ShellPgaTrainingOptions options;
  options.modes = 2;
  options.path_steps = 2;
  options.coarse_vertices = 60;
  return options;
}

}  // namespace shaped::test
