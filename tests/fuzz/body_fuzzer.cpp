// A stored body model whose tensors hold anything: editedModel().

#include "core/io/file_error.h"
#include "core/model/body_shapes.h"
#include "tests/fuzz/edited_model.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/small_model.h"

using namespace shaped;
using namespace shaped::fuzz;

namespace {

StoredModel publishSmallBody() {
  const ModelDirectory directory(scratchFolder() / "bodies");
  publishBody(directory, "small", smallBody(),
              {5, PostureNormalisation::kSkeleton, 0.1, Eigen::Vector3d(0.04, 0.01, 0.001), 1});
  return directory.load("small");
}

const StoredModel& soundBody() {
  static const StoredModel stored = publishSmallBody();
  return stored;
}

/// What every request takes for granted.
void requireUsable(const BodyModel& model) {
  const auto& parts = model.parts();
  require(model.modeCount() >= 1 && parts.deviations.minCoeff() > 0, "a body has modes, which have deviations");
  require(parts.mean.allFinite() && parts.modes.allFinite(), "mean and modes are finite");
  require(model.skeleton().jointCount() >= 1, "a body has a joint");
  require(parts.weights.rows() == parts.mean.rows() && parts.regressor.cols() == parts.mean.rows(), "sizes fit");
}

/// Numbers of any size may overflow, but not crash.
void answerOnce(StoredBody stored) {
  const BodyShapes shapes(std::move(stored.model), std::move(stored.training), std::move(stored.field));
  shapes.warm();
  const auto state = shapes.model()->meanState();
  accepted<InvalidInput>([&] { return shapes.synthesize(coefficientsOf(state, shapes.modes()), {}); });
  require(shapes.bytes() > 0, "a body takes memory");
}

}  // namespace

FUZZ_TARGET(body) {
  const auto stored = editedModel(soundBody(), bytes);
  if (!stored) return;
  auto body = accepted<FileError>([&] { return loadBody(*stored); });
  if (!body) return;
  requireUsable(body->model);
  answerOnce(std::move(*body));
}
