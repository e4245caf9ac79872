#include "core/model/shell_pga_tasks.h"
#include "tests/benchmark/experiments/experiment.h"
#include "tests/benchmark/experiments/models.h"
#include "tests/benchmark/experiments/timing.h"

namespace shaped::experiments {
namespace {

/// `count` vertices far from each other: each is the farthest from those before it.
std::vector<std::int32_t> spreadVertices(const Vertices& shape, int count) {
  const Eigen::RowVector3d centre = shape.colwise().mean();
  Eigen::VectorXd distance = (shape.rowwise() - centre).rowwise().squaredNorm();
  std::vector<std::int32_t> chosen;
  for (int i = 0; i < count; ++i) {
    Eigen::Index farthest = 0;
    distance.maxCoeff(&farthest);
    chosen.push_back(static_cast<std::int32_t>(farthest));
    const Eigen::VectorXd from_here = (shape.rowwise() - shape.row(farthest).eval()).rowwise().squaredNorm();
    distance = i == 0 ? from_here : Eigen::VectorXd(distance.cwiseMin(from_here));
  }
  return chosen;
}

bool falls(const std::vector<double>& energies) {
  for (std::size_t i = 1; i < energies.size(); ++i)
    if (energies[i] > energies[i - 1]) return false;
  return true;
}

/// Trains without one shape and asks for its positions at five vertices.
void editTowards(Report& report, const DataSet& set, std::size_t left_out, int modes) {
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < set.shapes.size(); ++i)
    if (i != left_out) kept.push_back(i);
  const auto model = keptOrTrained(text("%s-without-%zu", set.name.c_str(), left_out), subset(set, kept), modes);
  const OneThread one_thread;
  const Stopwatch analysis;
  model->fineStructure();
  const double analysed = analysis.cpu();
  const auto& wanted = set.shapes[left_out];
  std::vector<Handle> handles;
  for (const auto vertex : spreadVertices(model->mean(), 5))
    handles.push_back({vertex, wanted.row(vertex).transpose()});
  const Stopwatch watch;
  const auto edited = edit(*model, handles, {});
  const double seconds = watch.cpu();
  const auto& result = edited.solution;
  const std::string which = text("%s (%ld vertices, J = %d, positions of the unseen shape %zu): ", set.name.c_str(),
                                 static_cast<long>(wanted.rows()), model->modes(), left_out);
  report.entry(which + "largest handle distance",
               text("%.1e (%s)", result.largest_handle_distance, name(edited.termination).data()), "<= 1e-6",
               result.largest_handle_distance <= 1e-6);
  std::string energies;
  for (const double energy : result.energies) energies += text("%s%.5g", energies.empty() ? "" : ", ", energy);
  report.entry(which + "W[s, P[s]] over the outer iterations", energies, "falls", falls(result.energies));
  report.entry(which + "CPU s",
               text("%.2f (symbolic analysis of the full mesh, once per model: %.2f)", seconds, analysed), "<= 3",
               seconds <= 3);
  report.entry(which + "smallest area ratio", text("%.3f", result.smallest_area_ratio));
}

}  // namespace

void row10HandleEdits() {
  Report report("Row 10: editing with five handles");
  editTowards(report, cactus(), 5, 10);
  editTowards(report, cow(), 3, 5);
}

}  // namespace shaped::experiments
