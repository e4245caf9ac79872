// A stored model whose tensors hold anything: editedModel().

#include "core/io/file_error.h"
#include "core/model/shell_pga_file.h"
#include "core/model/shell_pga_tasks.h"
#include "tests/fuzz/edited_model.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/small_model.h"

using namespace shaped;
using namespace shaped::fuzz;

namespace {

StoredModel publishSmallModel() {
  const ModelDirectory directory(scratchFolder() / "models");
  publishShellPga(directory, "small", *smallModel());
  return directory.load("small");
}

const StoredModel& soundModel() {
  static const StoredModel stored = publishSmallModel();
  return stored;
}

/// What every request takes for granted.
void requireUsable(const ShellPgaModel& model) {
  const auto& pga = model.pga();
  require(pga.modes() >= 1 && pga.path_steps >= 1, "a model has modes and path steps");
  require(pga.eigenvalues.allFinite() && pga.eigenvectors.allFinite(), "the statistics are finite");
  require(model.parts().bending > 0 && std::isfinite(model.parts().bending), "the bending weight is positive");
  require(model.mean().allFinite(), "the mean is finite");
  for (std::int32_t v = 0; v < model.topology().vertexCount(); ++v) {
    const auto anchor = model.anchorOfVertex(v, "vertex");
    require(anchor.face >= 0 && anchor.barycentric.allFinite() && anchor.offset.allFinite(), "a vertex has an anchor");
  }
}

/// Answers of a model that is sound to read but means nothing may be poor, and say so.
void synthesizeOnce(const ShellPgaModel& model) {
  SubmanifoldPoint point;
  point.alpha = Eigen::VectorXd::Constant(2 * model.modes(), 0.5 / model.modes());
  point.scale = 0.5;
  const auto solved = synthesize(model, point, {});
  require(!solved.converged() || solved.solution.shape.allFinite(), "a converged shape is finite");
}

}  // namespace

FUZZ_TARGET(shell_pga) {
  const auto stored = editedModel(soundModel(), bytes);
  if (!stored) return;
  const auto model = accepted<FileError>([&] { return loadShellPga(*stored); });
  if (!model) return;
  requireUsable(**model);
  synthesizeOnce(**model);
}
