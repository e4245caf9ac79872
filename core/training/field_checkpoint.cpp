#include "core/training/field_checkpoint.h"

#include "core/io/sealed_tensors.h"
#include "core/neural/jacobian_field_file.h"

namespace shaped {
namespace {

constexpr const char *kFormat = "jacobian_field_checkpoint 1", *kTrainingKey = "training";

}  // namespace

void writeFieldCheckpoint(const std::filesystem::path& path, const FieldTrainingState& state,
                          const std::string& training) {
  TensorWriter file;
  file.setMetadata(kTrainingKey, training);
  addJacobianField("field", state.weights, file);
  file.addMatrix("adam.first", state.first);
  file.addMatrix("adam.second", state.second);
  file.addMatrix("step", Eigen::Matrix<std::int64_t, 1, 1>(state.step));
  const auto& loss = state.epoch_loss;
  file.addMatrix("epoch_loss", Eigen::RowVector3d(loss.total, loss.vertex, loss.jacobian));
  writeSealed(path, file, kFormat);
}

FieldCheckpoint readFieldCheckpoint(const std::filesystem::path& path) {
  const TensorFile file(path);
  requireSealed(file, path, kFormat);
  FieldCheckpoint checkpoint;
  checkpoint.training = metadataOf(file, path, kTrainingKey);
  auto& state = checkpoint.state;
  state.weights = readJacobianField(file, "field");
  state.first = file.matrix<float>("adam.first", -1, 1);
  state.second = file.matrix<float>("adam.second", -1, 1);
  state.step = file.matrix<std::int64_t>("step", 1, 1)(0, 0);
  const Eigen::RowVector3d loss = file.matrix<double>("epoch_loss", 1, 3);
  state.epoch_loss = {loss[0], loss[1], loss[2]};
  return checkpoint;
}

}  // namespace shaped
