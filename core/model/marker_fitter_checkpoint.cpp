#include "core/model/marker_fitter_checkpoint.h"

#include "core/io/sealed_tensors.h"
#include "core/model/state_tensors.h"

namespace shaped {
namespace {

constexpr const char* kFormat = "marker_fitter_checkpoint 1";

}  // namespace

void writeFitterCheckpoint(const std::filesystem::path& path, const MarkerFitterCheckpoint& checkpoint) {
  const auto& state = checkpoint.state;
  const auto& projection = state.projection;
  TensorWriter file;
  file.addMatrix("counts", Eigen::Matrix<std::int64_t, 1, 3>(checkpoint.frames, state.started ? 1 : 0,
                                                             state.calibrated ? 1 : 0));
  file.addMatrix("numbers", Eigen::RowVector4d(state.calibrated.value_or(0), state.scale, projection.point.scale,
                                               projection.local_energy));
  file.addMatrix("shape", state.shape);
  file.addMatrix("prior", state.prior);
  file.addMatrix("projection.alpha", projection.point.alpha);
  file.addMatrix("projection.shape", projection.shape);
  file.addMatrix("projection.local", projection.local);
  file.addMatrix("projection.geodesic", stack(projection.geodesic));
  writeSealed(path, file, kFormat);
}

MarkerFitterCheckpoint readFitterCheckpoint(const std::filesystem::path& path) {
  const TensorFile file(path);
  requireSealed(file, path, kFormat);
  const auto counts = file.values<std::int64_t>("counts");
  const auto numbers = file.values<double>("numbers");
  MarkerFitterCheckpoint checkpoint{counts[0], {}};
  auto& state = checkpoint.state;
  state.started = counts[1] != 0;
  if (counts[2] != 0) state.calibrated = numbers[0];
  state.scale = numbers[1];
  state.shape = file.matrix<double>("shape", -1, 3);
  state.prior = file.matrix<double>("prior", -1, 3);
  auto& projection = state.projection;
  projection.point = {file.matrix<double>("projection.alpha", -1, 1), numbers[2]};
  projection.shape = file.matrix<double>("projection.shape", -1, 3);
  projection.local = file.matrix<double>("projection.local", -1, 3);
  projection.geodesic = unstack(file.matrix<double>("projection.geodesic", -1, 3), state.shape.rows());
  projection.local_energy = numbers[3];
  return checkpoint;
}

}  // namespace shaped
