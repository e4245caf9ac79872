#include "tests/benchmark/experiments/models.h"

#include <cstdlib>

#include "core/model/shell_pga_file.h"

namespace shaped::experiments {
namespace {

ModelDirectory cache() {
  const char* folder = std::getenv("SHAPED_EXPERIMENTS_CACHE");
  if (folder) return ModelDirectory(folder);
  const char* home = std::getenv("HOME");
  return ModelDirectory(std::filesystem::path(home ? home : ".") / ".cache" / "shaped-experiments");
}

}  // namespace

Solved<ShellPgaModelPtr> train(const DataSet& set, int modes, std::optional<double> bending) {
  ShellPgaTrainingOptions options;
  options.modes = modes;
  options.path_steps = 4;
  options.bending = bending;
  options.coarse_vertices = 1000;
  return trainShellPga({set.topology, set.shapes, {}}, options, {}, {});
}

void keep(const std::string& model_name, const ShellPgaModel& model) { publishShellPga(cache(), model_name, model); }

ShellPgaModelPtr keptOrTrained(const std::string& model_name, const DataSet& set, int modes) {
  try {
    return loadShellPga(cache().load(model_name));
  } catch (const ModelNotFound&) {
  }
  const auto trained = train(set, modes);
  if (!trained.solution)
    throw std::runtime_error("training of " + model_name + " ended with " + std::string(name(trained.termination)));
  keep(model_name, *trained.solution);
  return trained.solution;
}

}  // namespace shaped::experiments
