#include "core/bootstrap/bootstrap_checkpoint.h"

#include "core/bootstrap/report_json.h"
#include "core/io/sealed_tensors.h"
#include "core/model/state_tensors.h"
#include "core/neural/jacobian_field_file.h"
#include "core/skeleton/skinning.h"

namespace shaped {
namespace {

constexpr const char *kFormat = "bootstrap_checkpoint 1", *kTrainingKey = "training", *kRoundsKey = "rounds",
                     *kScansKey = "scans", *kField = "field";

/// What a row of states begins with.
enum class Row { kNotYet, kFitted, kWithoutNumbers };

/// `name`: a row for each state, Row, identity and pose (0 where there are none). `name`.modes: k.
void addStates(const std::string& name, const std::vector<std::optional<BodyState>>& states, TensorWriter& file) {
  Eigen::Index modes = 0, numbers = 0;
  for (const auto& state : states)
    if (state && state->identity.size() > 0)
      modes = state->identity.size(), numbers = modes + toVector(state->pose).size();
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(std::ssize(states), 1 + numbers);
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (!states[i]) continue;
    auto row = rows.row(static_cast<Eigen::Index>(i));
    row[0] = static_cast<double>(Row::kWithoutNumbers);
    if (states[i]->identity.size() == 0) continue;
    row << static_cast<double>(Row::kFitted), states[i]->identity.transpose(), toVector(states[i]->pose).transpose();
  }
  file.addMatrix(name, rows);
  file.addMatrix(name + ".modes", Eigen::Matrix<std::int64_t, 1, 1>(modes));
}

std::vector<std::optional<BodyState>> readStates(const TensorFile& file, const std::string& name) {
  const Eigen::MatrixXd rows = file.matrix<double>(name);
  const Eigen::Index modes = file.values<std::int64_t>(name + ".modes")[0];
  std::vector<std::optional<BodyState>> states;
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    auto& state = states.emplace_back();
    const auto kind = static_cast<Row>(static_cast<int>(rows(i, 0)));
    if (kind != Row::kNotYet) state.emplace();
    if (kind != Row::kFitted) continue;
    const Eigen::VectorXd numbers = rows.row(i).tail(rows.cols() - 1);
    *state = {numbers.head(modes), poseFrom(numbers.tail(numbers.size() - modes))};
  }
  return states;
}

}  // namespace

std::string BootstrapCheckpoint::stage() const {
  const std::string round = "round " + std::to_string(rounds.size() + 1) + ", ";
  if (!scans.empty()) return round + "registering, " + std::to_string(scans.size()) + " scans done";
  if (field) return round + "field trained";
  std::size_t fitted = 0;
  for (const auto& example : examples) fitted += example.has_value();
  return round + "fitting the field's scans, " + std::to_string(fitted) + " done";
}

void writeBootstrapCheckpoint(const std::filesystem::path& path, const BootstrapCheckpoint& checkpoint) {
  TensorWriter file;
  file.setMetadata(kTrainingKey, checkpoint.training);
  file.setMetadata(kRoundsKey, textOf(checkpoint.rounds));
  std::vector<BootstrapScan> reports;
  std::vector<std::optional<BodyState>> states;
  for (const auto& [report, state] : checkpoint.scans) {
    reports.push_back(report);
    states.emplace_back(state);
  }
  file.setMetadata(kScansKey, textOf(reports));
  addStates("scan_states", states, file);
  addStates("example_states", checkpoint.examples, file);
  file.addMatrix("joined", stack(checkpoint.joined));
  const Eigen::RowVector2<std::int64_t> counts(checkpoint.trainings, std::ssize(checkpoint.joined));
  file.addMatrix("counts", counts);
  if (checkpoint.field) addJacobianField(kField, *checkpoint.field, file);
  writeSealed(path, file, kFormat);
}

BootstrapCheckpoint readBootstrapCheckpoint(const std::filesystem::path& path) {
  const TensorFile file(path);
  requireSealed(file, path, kFormat);
  BootstrapCheckpoint checkpoint;
  checkpoint.training = metadataOf(file, path, kTrainingKey);
  checkpoint.rounds = roundsFrom(metadataOf(file, path, kRoundsKey));
  const auto reports = scansFrom(metadataOf(file, path, kScansKey));
  const auto states = readStates(file, "scan_states");
  for (std::size_t i = 0; i < reports.size(); ++i) checkpoint.scans.push_back({reports[i], states.at(i).value()});
  checkpoint.examples = readStates(file, "example_states");
  const auto counts = file.values<std::int64_t>("counts");
  checkpoint.trainings = static_cast<int>(counts[0]);
  const Vertices joined = file.matrix<double>("joined", -1, 3);
  if (counts[1] > 0) checkpoint.joined = unstack(joined, joined.rows() / counts[1]);
  if (file.has(std::string(kField) + ".offsets")) checkpoint.field = readJacobianField(file, kField);
  return checkpoint;
}

}  // namespace shaped
